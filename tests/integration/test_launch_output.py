"""Output and log files of `callboard launch`, with real processes and a real terminal."""

from __future__ import annotations

import asyncio
import json
import os
import re
import select
import signal
import sys
from typing import TYPE_CHECKING, Any

import pytest

from tests.fork_server.client import FORKED
from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.launch_files import launch_file
from tests.integration.processes import SLEEPER
from tests.integration.terminal import on_terminal

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

fcntl = pytest.importorskip("fcntl")
termios = pytest.importorskip("termios")

BOTH = "import sys; print('to stdout'); print('to stderr', file=sys.stderr)"
FLOOD = "import os\nfor number in range(20_000):\n    os.write(1 + number % 2, b'line %d\\n' % number)"


async def launch(system: System, state: Path, *arguments: str) -> Program:
    """Start a launch whose log files are in a folder."""
    return await system.program(
        *(sys.executable, "-m", "actors", "launch", "--stop-timeout", "0.2", *arguments),
        environ=os.environ | {"XDG_STATE_HOME": str(state)},
    )


def documents(program: Program) -> list[dict[str, Any]]:
    """Return the printed JSON documents."""
    return [json.loads(line) for line in program.lines]


async def test_json_reports_all_events(system: System, tmp_path: Path) -> None:
    """From the start of the broker to the exit code; nothing else is written, not even to stderr."""
    file = launch_file(tmp_path, "Node(script='both.py', required=True)", both=f"{BOTH}; sys.exit(3)")
    program = await launch(system, tmp_path / "state", file, "--json")
    assert await program.wait_for_exit() == 1
    said = documents(program)
    assert {each["event"] for each in said} == {"message", "started", "output", "exited", "stopping", "ended"}
    (exited,) = (each for each in said if each["event"] == "exited")
    (started,) = (each for each in said if each["event"] == "started")
    assert exited == {
        "event": "exited",
        "time": exited["time"],
        "process": "both-1",
        "pid": started["pid"],
        "returncode": 3,
        "signal": None,
        "normal": False,
        "reason": "exit code 3",
    }
    lines = sorted(each["line"] for each in said if each["event"] == "output")
    assert lines == ["to stderr", "to stdout"]
    assert said[-1] == {"event": "ended", "time": said[-1]["time"], "exit_code": 1}
    assert not (tmp_path / "state").exists()


async def test_json_ends_with_the_exit_code(system: System, tmp_path: Path) -> None:
    """Also when the launch is stopped, or no broker can be started."""
    file = launch_file(tmp_path, "Node(script='sleeper.py')", sleeper=SLEEPER)
    program = await launch(system, tmp_path, file, "--json")
    await program.wait_for_line('"output"')
    assert await program.stop() == 0
    assert documents(program)[-1]["exit_code"] == 0
    program = await launch(system, tmp_path, file, "--json", "--url", "callboard://broker.invalid:7411")
    assert await program.wait_for_exit() == 3
    ended, *error = program.lines
    assert json.loads(ended)["exit_code"] == 3
    assert error[0].startswith("No broker at callboard://broker.invalid:7411")


async def test_output_can_go_to_a_log(system: System, tmp_path: Path) -> None:
    """With --output log all lines are in the file, and those of stderr also on the screen."""
    action = "Node(script='both.py', output='screen')"
    program = await launch(system, tmp_path, launch_file(tmp_path, action, both=BOTH), "--output", "log")
    assert await program.wait_for_exit() == 0
    folder = tmp_path / "callboard" / "log" / "latest"
    assert f"[INFO] [launch]: log files are in {folder.resolve()}" in program.lines
    assert "[both-1] to stderr" in program.lines
    assert "to stdout" not in program.output
    log = (folder / "launch.log").read_text()
    assert sorted(re.findall(r"^\S+Z \[both-1\] (.*)$", log, re.MULTILINE)) == ["to stderr", "to stdout"]
    assert re.search(
        r"^\S+Z \[INFO\] \[both-1\]: process has finished cleanly \[pid \d+\]$", log, re.MULTILINE
    )


async def test_each_process_has_its_own_output_setting(system: System, tmp_path: Path) -> None:
    """One writes to files of its own, the other to the screen."""
    actions = "Node(script='both.py', output='own_log')", "Node(script='other.py')"
    file = launch_file(tmp_path, *actions, both=BOTH, other="print('shown')")
    program = await launch(system, tmp_path, file)
    assert await program.wait_for_exit() == 0
    assert "[other-2] shown" in program.lines
    assert "to std" not in program.output
    folder = tmp_path / "callboard" / "log" / "latest"
    assert (folder / "both-1-stdout.log").read_text() == "to stdout\n"
    assert (folder / "both-1-stderr.log").read_text() == "to stderr\n"
    assert sorted((folder / "both-1.log").read_text().split("\n")) == ["", "to stderr", "to stdout"]


async def test_a_large_output_is_logged_completely(system: System, tmp_path: Path) -> None:
    """All lines are in the log and on the screen, in order."""
    file = launch_file(tmp_path, "Node(script='flood.py')", flood=FLOOD)
    program = await launch(system, tmp_path, file, "--output", "both")
    assert await program.wait_for_exit() == 0
    log = (tmp_path / "callboard" / "log" / "latest" / "launch.log").read_text()
    for text in (log, program.output):
        assert re.findall(r" line (\d+)", text) == [str(number) for number in range(20_000)]


async def test_a_launch_continues_without_log_files(system: System, tmp_path: Path) -> None:
    """If they cannot be written it reports that, and how many lines are missing."""
    (tmp_path / "state").touch()
    program = await launch(
        system,
        tmp_path / "state",
        launch_file(tmp_path, "Node(script='both.py')", both=BOTH),
        "--output",
        "both",
    )
    assert await program.wait_for_exit() == 0
    where = tmp_path / "state" / "callboard" / "log"
    assert f"[ERROR] [launch]: log files in {where} cannot be written: Not a directory" in program.lines
    assert re.search(r"^\[WARN\] \[launch\]: \d+ lines are missing in the log files$", program.lines[-1])
    assert "[both-1] to stdout" in program.lines


@pytest.mark.parametrize(
    ("given", "options", "expected"),
    [
        ({}, (), "1"),
        ({}, ("--json",), "None"),
        ({"FORCE_COLOR": "0"}, (), "0"),
        ({"NO_COLOR": "1"}, (), "None"),
    ],
)
async def test_force_color_is_set_for_programs(
    system: System,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    given: dict[str, str],
    options: tuple[str, ...],
    expected: str,
) -> None:
    """It is set if a terminal shows their output and the environment does not decide otherwise."""
    for name in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    file = launch_file(
        tmp_path,
        "Node(script='tell.py')",
        tell="import os; print('color', os.environ.get('FORCE_COLOR'), '!')",
    )
    async with on_terminal("launch", file, "--url", system.url, *options, term="xterm", **given) as terminal:
        await terminal.wait_for_text(f"color {expected} !")


async def test_a_terminal_shows_a_status_line(system: System, tmp_path: Path) -> None:
    """It is below the last line, and is removed when the launch has stopped."""
    actions = "Node(script='sleeper.py')", "Node(script='bad.py')"
    file = launch_file(tmp_path, *actions, sleeper=SLEEPER, bad="raise SystemExit(3)")
    async with on_terminal("launch", file, "--url", system.url, term="xterm") as terminal:
        await terminal.wait_for_text("\x1b[32m1 up\x1b[0m · \x1b[31m1 dead\x1b[0m · Ctrl-C stops")
        terminal.process.send_signal(signal.SIGINT)
        await terminal.wait_for_text("stopping: 0 left · Ctrl-C again kills\r\x1b[K")
        assert await terminal.wait_for_exit() == 0


PRINTING = """
from actors.launch import ExecuteProcess, LaunchDescription, OnProcessIO, OpaqueFunction, RegisterEventHandler

def loud(*_):
    print("x" * 2000)

def generate_launch_description():
    print("describing")
    script = "while :; do echo more; sleep 0.001; done"
    return LaunchDescription([
        OpaqueFunction(function=loud),
        RegisterEventHandler(OnProcessIO(on_output=loud)),
        ExecuteProcess(cmd=["sh", "-c", script], name="more"),
    ])
"""


async def test_prints_of_a_handler_never_block_a_launch(system: System, tmp_path: Path) -> None:
    """With a full stdout the launch still stops on SIGINT."""
    (tmp_path / "loud.launch.py").write_text(PRINTING)
    reading, writing = os.pipe()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "launch", str(tmp_path / "loud.launch.py"), "--url", system.url),
        executable=FORKED,
        cwd=ROOT,
        stdout=writing,
        start_new_session=True,
    )
    try:
        async with asyncio.timeout(DEADLINE_SEC):
            while select.select([], [writing], [], 0)[1]:  # until the pipe is full
                await asyncio.sleep(0.01)
            process.send_signal(signal.SIGINT)
            await process.wait()
    finally:
        os.close(writing)
        os.close(reading)


async def test_json_is_not_mixed_with_prints(system: System, tmp_path: Path) -> None:
    """Prints of launch files, functions and handlers go to stderr."""
    (tmp_path / "loud.launch.py").write_text(
        PRINTING.replace("while :; do echo more; sleep 0.001; done", "echo")
    )
    program = await system.program(
        *("sh", "-c", f'"$0" -m actors launch "$1" --json 2>{tmp_path}/errors'),
        *(sys.executable, str(tmp_path / "loud.launch.py")),
    )
    assert await program.wait_for_exit() == 0
    assert {each["event"] for each in documents(program)} >= {"started", "output", "ended"}
    errors = (tmp_path / "errors").read_text().splitlines()
    assert errors == ["describing", "x" * 2000, "x" * 2000]
