"""`callboard launch`: nodes in its own process, terminals for programs, and restarts of changed scripts."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import sys
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import ROOT
from tests.integration.launch_files import launch_file, start_launch
from tests.integration.processes import wait_until_dead

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

OWN = """
from actors import Node
from actors.launch import LaunchDescription
from actors.launch import Node as Launched


class Talker(Node):
    def __init__(self) -> None:
        super().__init__("talker")
        print("made", end=" ")
        print("here")
        self.create_timer(0.05, lambda: self.get_logger().info(f"I am {self.get_fully_qualified_name()}"))


def broken() -> Node:
    raise ValueError("no such map")


def generate_launch_description():
    return LaunchDescription([
        Launched(node=Talker, name="anna", namespace="ns1"),
        Launched(node=Talker),
        Launched(node=broken),
        Launched(node="minimal_node:MinimalNode", name="named"),
    ])
"""

NAMED = """
import actors


class MinimalNode(actors.Node):
    def __init__(self) -> None:
        super().__init__("minimal")
        self.get_logger().warning("by its name")
"""

TERMINAL = """
import os, sys
size = os.get_terminal_size(1)
print("terminal", os.isatty(1), os.isatty(2), size.columns, size.lines)
print("pid", os.getpid(), file=sys.stderr)
sys.stdout.flush()
sys.stderr.write("no end")
"""


async def test_nodes_run_in_the_launchs_process(system: System, tmp_path: Path) -> None:
    """Each has a name and a label; a failing one does not affect the others; Ctrl-C stops all with 0."""
    file = tmp_path / "own.launch.py"
    file.write_text(OWN)
    (tmp_path / "minimal_node.py").write_text(NAMED)
    environ = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
    program = await system.program(sys.executable, "-m", "actors", "launch", str(file), environ=environ)
    for text in ("[ns1.anna]: I am /ns1/anna", "[talker]: I am /talker", "[named]: by its name"):
        line = await program.find_line(text)
        assert re.match(r"\[\w+-[124]\] \[(INFO|WARN)\] \[\d+\.\d+\] ", line)
    assert await program.stop() == 0
    assert program.output.count("] made here") == 2
    assert "-3] ValueError: no such map" in program.output
    nodes = [line for line in program.output.splitlines() if "I am /ns1/anna" in line]
    assert all("-1] " in line for line in nodes)


async def test_a_program_can_have_a_terminal(system: System, tmp_path: Path) -> None:
    """With `emulate_tty` stdout and stderr are a terminal, and a last line without newline is shown."""
    file = launch_file(tmp_path, "Node(script='look.py', emulate_tty=True)", look=TERMINAL)
    program = await start_launch(system, file)
    assert await program.wait_for_exit() == 0
    assert "[look-1] terminal True True 80 24" in program.lines
    assert "[look-1] no end" in program.lines
    (pid,) = re.findall(r"\[look-1\] pid (\d+)$", program.output, re.MULTILINE)
    await wait_until_dead(int(pid))


async def test_a_changed_script_is_restarted(system: System, tmp_path: Path) -> None:
    """With `--watch` a running script restarts at once, and one that failed restarts after a change."""
    sleeps = "import time; print('{}'); time.sleep(1000)"
    file = launch_file(
        tmp_path,
        "Node(script='one.py')",
        "Node(script='two.py', required=True)",
        one=sleeps.format("first"),
        two="1 / 0",
    )
    program = await start_launch(system, file, "--watch")
    await program.wait_for_line("watching 1 folder for changes")
    await program.wait_for_line("[one-1] first")
    await program.find_line("[two-2] ZeroDivisionError")
    (tmp_path / "one.py").write_text(sleeps.format("second"))
    await program.wait_for_line("[one-1] second")
    (tmp_path / "two.py").write_text(sleeps.format("mended"))
    await program.wait_for_line("[two-2] mended")
    assert program.output.count("[one-1] second") == 1
    assert "one.py has changed" in program.output
    assert await program.stop() == 0


@pytest.mark.parametrize("streams", ["<&- >&-", "<&- >&- 2>&-", "2>&-"])
async def test_streams_may_be_closed(system: System, tmp_path: Path, streams: str) -> None:
    """With streams closed by the shell, no socket of the launch gets their numbers."""
    seen = tmp_path / "seen"
    look = f"""
import os, stat
kinds = [os.fstat(number).st_mode for number in range(3)]
open({str(seen)!r}, "w").write(str([stat.S_ISSOCK(mode) for mode in kinds]))
"""
    file = launch_file(tmp_path, "Node(script='look.py')", look=look)
    words = f'exec "$0" -m actors launch "$1" --url {system.url} {streams}'
    program = await system.program("sh", "-c", words, sys.executable, file)
    assert await program.wait_for_exit() == 0
    assert seen.read_text() == "[False, False, False]"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_command_in_a_launch_file_can_be_stopped(
    system: System, tmp_path: Path, number: signal.Signals
) -> None:
    """A signal ends the command of a substitution before any process has started."""
    os.mkfifo(begun := tmp_path / "begun")
    script = f"exec 3>{begun}; echo begun >&3; sleep 1000"
    file = launch_file(tmp_path, f"LogInfo(msg=Command(\"sh -c '{script}'\"))")
    program = await start_launch(system, file)
    with await asyncio.to_thread(begun.open) as pipe:
        assert await asyncio.to_thread(pipe.readline) == "begun\n"
        program.send_signal(number)
        assert await asyncio.to_thread(pipe.read) == ""
    assert await program.wait_for_exit() == 0
    assert "Traceback" not in program.output
