"""The course's programs as rclpy has them, run unchanged by the commands that the documents name."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT

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


async def test_arguments_are_ros_arguments(system: System) -> None:
    """A topic is renamed and the node, too; the command line sees both."""
    await system.broker()
    rules = ("-r", "addison:=news", "-r", "__node:=reporter")
    program = await start(system, "run", "minimal_publisher", "--ros-args", *rules)
    await program.wait_for_line("[reporter]: Publishing")
    shown = await system.python("-m", "actors", "topic", "list")
    assert await shown.wait_for_exit() == 0
    assert "/news" in shown.output


async def test_what_cannot_be_run_is_named(system: System) -> None:
    """A script, a package and a program that do not exist: one line and exit code 2."""
    for args, text in (
        (["none.py"], "No script 'none.py'"),
        (["none", "talker"], "No installed package 'none'"),
        (["callboard", "talker"], "No program 'talker' in package 'callboard'; there is: callboard"),
    ):
        program = await system.python("-m", "actors.ros", *args)
        assert await program.wait_for_exit() == 2
        assert text in program.output
        assert "Traceback" not in program.output
