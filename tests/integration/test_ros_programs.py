"""The course's programs as rclpy has them, run unchanged by the commands that the documents name."""

from __future__ import annotations

import os
import shutil
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.guides import Environment, builds_packages
from tests.integration.processes import pids_in, wait_until_dead

if TYPE_CHECKING:
    from tests.integration.conftest import Program, System

PROGRAMS = Path(ROOT, "examples", "rclpy")


async def start(system: System, door: str, name: str, *args: str) -> Program:
    """Run a program by `callboard run --ros` or by `python -m actors.ros`."""
    command = ("actors", "run", "--ros") if door == "run" else ("actors.ros",)
    return await system.python("-u", "-m", *command, str(PROGRAMS / f"{name}.py"), *args)


@pytest.mark.parametrize("door", ["run", "module"])
async def test_the_course_runs_without_ros(system: System, door: str) -> None:
    """Topics and the service work; SIGINT and SIGTERM end the programs quietly."""
    await system.broker()
    names = ("minimal_publisher", "minimal_subscriber", "publishing_subscriber", "add_two_ints_server")
    programs = {name: await start(system, door, name) for name in names}
    await programs["minimal_publisher"].wait_for_line('Publishing: "Hi Automatic Addison: 1"')
    await programs["minimal_subscriber"].wait_for_line('I heard: "Hi Automatic Addison: ')
    await programs["publishing_subscriber"].wait_for_line("I heard Hi Automatic Addison: ")
    client = await start(system, door, "add_two_ints_client", "5", "3")
    assert await client.wait_for_exit() == 0
    assert "5 + 3 = 8" in client.output
    await programs["add_two_ints_server"].wait_for_line("Incoming request: 5 + 3")
    for number, name in zip((signal.SIGINT, signal.SIGTERM) * 2, names, strict=True):
        programs[name].send_signal(number)
        assert await programs[name].wait_for_exit() == 0
        assert "Traceback" not in programs[name].output


ROBOTS = """
import sys

from launch import LaunchDescription
from launch.actions import ExecuteProcess


def generate_launch_description():
    program = [sys.executable, {program!r}]
    return LaunchDescription(
        [
            ExecuteProcess(cmd=program, name="first", output="screen"),
            ExecuteProcess(
                cmd=program, name="other", output="screen", additional_env={{"ROS_DOMAIN_ID": "7"}}
            ),
        ]
    )
"""


async def test_domains_of_ros_separate_graphs(
    system: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS_DOMAIN_ID counts for programs and launches with --ros; commands warn, and follow with --domain."""

    async def nodes(*options: str) -> str:
        command = await system.python("-m", "actors", "node", "list", *options)
        assert await command.wait_for_exit() == 0
        return command.output

    await system.broker()
    monkeypatch.setenv("ROS_DOMAIN_ID", "5")
    file = tmp_path / "robots.launch.py"
    file.write_text(ROBOTS.format(program=str(PROGRAMS / "minimal_publisher.py")), encoding="utf-8")
    launch = await system.python("-m", "actors", "launch", "--ros", str(file))
    while not all(any(f"[{each}]" in line for line in launch.lines) for each in ("first-1", "other-2")):
        await launch.wait_for_line("Publishing")
    here = await nodes()
    assert "/minimal_publisher" not in here
    assert "ROS_DOMAIN_ID=5 counts for programs that run with --ros only" in here
    for domain in ("5", "7"):
        assert await nodes("--domain", domain) == "/minimal_publisher"
    assert "ROS_DOMAIN_ID" not in launch.output
    program = await start(system, "run", "minimal_subscriber")
    await program.wait_for_line("I heard: ")
    assert "ROS_DOMAIN_ID" not in program.output


async def test_arguments_are_ros_arguments(system: System) -> None:
    """A topic is renamed and the node, too; the command line sees both."""
    await system.broker()
    rules = ("-r", "addison:=news", "-r", "__node:=reporter")
    program = await start(system, "run", "minimal_publisher", "--ros-args", *rules)
    await program.wait_for_line("[reporter]: Publishing")
    shown = await system.python("-m", "actors", "topic", "list")
    assert await shown.wait_for_exit() == 0
    assert "/news" in shown.output


CHILDREN = """
import multiprocessing
import subprocess
import sys

import rclpy.constants
from tests.fork_server.client import FORKED


def seconds(count):
    return count * rclpy.constants.S_TO_NS


if __name__ == "__main__":
    for method in ("spawn", "forkserver"):
        with multiprocessing.get_context(method).Pool(1) as pool:
            print(method, pool.apply(seconds, (2,)), flush=True)
    code = "import rclpy.constants; print('child', rclpy.constants.S_TO_NS)"
    subprocess.run([sys.executable, "-c", code], executable=FORKED, check=True)
"""


@pytest.mark.long
@builds_packages
@pytest.mark.timeout(6 * DEADLINE_SEC)
async def test_installed_programs_run_as_they_are(system: System, tmp_path: Path) -> None:
    """With packaging/callboard-ros: the course's package and its launch file, child processes, and pytest."""
    environment = Environment(tmp_path / "environment")
    hook, package = tmp_path / "hook", tmp_path / "package"
    shutil.copytree(ROOT / "packaging" / "callboard-ros", hook)  # building writes there
    shutil.copytree(PROGRAMS, package)

    async def run(program: str, *args: str) -> Program:
        command = str(environment.programs / program)
        return await system.program(command, *args, folder=tmp_path, environ=environment.variables)

    for folder in (hook, package):
        installed = await run("pip", "install", str(folder))
        # An installer starts several programs, one after the other.
        assert await installed.wait_for_exit(3 * DEADLINE_SEC) == 0, installed.output
    await system.broker()
    names = ("minimal_publisher", "minimal_subscriber", "publishing_subscriber", "add_two_ints_server")
    programs = {name: await run("callboard", "run", "course_package", name) for name in names}
    await programs["minimal_publisher"].wait_for_line('Publishing: "Hi Automatic Addison: 1"')
    await programs["minimal_subscriber"].wait_for_line('I heard: "Hi Automatic Addison: ')
    await programs["publishing_subscriber"].wait_for_line("I heard Hi Automatic Addison: ")
    client = await run("callboard", "run", "course_package", "add_two_ints_client", "5", "3")
    assert await client.wait_for_exit() == 0, client.output
    assert "5 + 3 = 8" in client.output
    for program in programs.values():
        program.send_signal(signal.SIGINT)
        assert await program.wait_for_exit() == 0, program.output
    launch = await run("callboard", "launch", "course_package", "course_launch.py")
    await launch.wait_for_line("[ns1.minimal_publisher]: Publishing")
    launch.send_signal(signal.SIGINT)
    assert await launch.wait_for_exit() == 0, launch.output
    (tmp_path / "children.py").write_text(CHILDREN)
    children = await run("python", str(tmp_path / "children.py"))
    assert await children.wait_for_exit() == 0, children.output
    for each in ("spawn 2000000000", "forkserver 2000000000", "child 1000000000"):
        assert each in children.output
    (tmp_path / "test_names.py").write_text(
        "def test_name():\n    from rclpy.node import Node\n    assert Node\n"
    )
    options = ("-q", "-p", "no:randomly", "-p", "no:cacheprovider")
    tested = await run("python", "-m", "pytest", *options, str(tmp_path / "test_names.py"))
    assert await tested.wait_for_exit() == 0, tested.output


async def test_two_programs_start_one_broker(system: System, tmp_path: Path) -> None:
    """Whichever is first says so; the broker outlives it, also if the terminal's group gets Ctrl-C."""
    system.variables["XDG_STATE_HOME"] = str(tmp_path)
    talker, listener = [
        await start(system, "module", f"minimal_{name}") for name in ("publisher", "subscriber")
    ]
    await listener.wait_for_line('I heard: "Hi Automatic Addison: ')
    said = [line for each in (talker, listener) for line in each.lines if "Started a broker at" in line]
    assert len(said) == 1
    (pid, *_) = pids_in(said[0].partition("(")[2])
    try:
        for program in (talker, listener):
            program.send_signal(signal.SIGINT)
            assert await program.wait_for_exit() == 0
        shown = await system.python("-m", "actors", "node", "list")
        assert await shown.wait_for_exit() == 0
    finally:
        os.kill(pid, signal.SIGTERM)
    await wait_until_dead(pid)


async def test_no_broker_is_started_if_it_is_refused(system: System) -> None:
    """The node says that it finds none, as any node does."""
    program = await system.python(
        "-m", "actors", "run", "--ros", "--no-broker", str(PROGRAMS / "minimal_publisher.py")
    )
    await program.wait_for_line("No broker at")
    assert "Started" not in program.output


async def test_what_cannot_be_run_is_named(system: System) -> None:
    """A script, a package and a program that do not exist: one line and exit code 2."""
    for args, text in (
        (["none.py"], "No script 'none.py'"),
        (["none", "talker"], "No script and no installed package 'none'"),
        (["callboard", "talker"], "No program 'talker' in package 'callboard'; there is: callboard"),
    ):
        program = await system.python("-m", "actors.ros", *args)
        assert await program.wait_for_exit() == 2
        assert text in program.output
        assert "Traceback" not in program.output


async def test_a_package_is_installed_and_launched(
    system: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pip installs it as it is; its launch files start its programs in a namespace, and Ctrl-C stops them."""
    target = tmp_path / "target"
    source = shutil.copytree(PROGRAMS, tmp_path / "source")  # setuptools builds in its folder
    options = ("--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--target", str(target))
    pip = await system.python("-m", "pip", "install", "--disable-pip-version-check", *options, str(source))
    assert await pip.wait_for_exit() == 0, pip.output
    await system.broker()
    monkeypatch.setenv("PYTHONPATH", str(target))
    for file in ("course_launch.py", "course.launch.xml"):
        launch = await system.python("-m", "actors", "launch", "--ros", "course_package", file)
        await launch.wait_for_line("[ns1.minimal_publisher]: Publishing")
        await launch.wait_for_line("[ns1.minimal_subscriber]: I heard")
        client = await system.python(
            *("-m", "actors", "run", "--ros", "course_package", "add_two_ints_client", "5", "3"),
            *("--ros-args", "-r", "__ns:=/ns1"),
        )
        assert await client.wait_for_exit() == 0, client.output
        assert "5 + 3 = 8" in client.output
        launch.send_signal(signal.SIGINT)
        assert await launch.wait_for_exit() == 0
        assert "Traceback" not in launch.output
