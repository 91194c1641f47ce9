"""`callboard launch` with lifecycle nodes: brought up, respawned, failing, killed and interrupted."""

from __future__ import annotations

import json
import os
import signal
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.launch_files import launch_file, start_launch
from tests.integration.processes import is_alive

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

TALKER: Final = """
    import asyncio, os, sys
    import actors
    from actors import TransitionCallbackReturn as Result
    from actors.interfaces.std_msgs.msg import String

    class Talker(actors.LifecycleNode):
        def __init__(self):
            super().__init__("talker")
            self.chatter = self.create_lifecycle_publisher(String, "chatter")
            self.create_timer(0.05, lambda: self.chatter.publish(String(data="hello")))

        async def on_configure(self, state):
            print("configuring", os.getpid())
            if "fail" in sys.argv:
                return Result.FAILURE
            if "raise" in sys.argv:
                raise OSError("no device")
            if "hang" in sys.argv:
                await asyncio.sleep(1000)
            return Result.SUCCESS

    async def main():
        async with Talker():
            await asyncio.Event().wait()

    actors.run(main)
"""
NODE: Final = "LifecycleNode(script='talker.py', name='talker', namespace=''"
STEP: Final = (
    "RegisterEventHandler(OnStateTransition(target_lifecycle_node='talker',"
    " start_state='{}', goal_state='{}', entities=[{}]))"
)
CHANGE: Final = "LifecycleTransition(lifecycle_node_names=['talker'], transition_ids=[{}])"


async def test_a_node_is_activated_step_by_step(system: System, tmp_path: Path) -> None:
    """By the event of each step, until its messages arrive; each step is a document of --json."""
    actions = (
        STEP.format("configuring", "inactive", CHANGE.format("'activate'")),
        STEP.format("activating", "active", "LogInfo(msg='it is up')"),
        f"{NODE})",
        CHANGE.format(1),
    )
    await system.broker()
    program = await start_launch(system, "--json", launch_file(tmp_path, *actions, talker=TALKER))
    await program.find_line("it is up")
    echo = await system.python("-m", "actors", "topic", "echo", "--once", "/chatter")
    assert await echo.wait_for_exit() == 0
    assert echo.lines == ["data: hello", "---"]
    assert await program.stop() == 0
    steps = [each for each in map(json.loads, program.lines) if each["event"] == "transition"]
    assert [(each["process"], each["transition"], each["goal_state"]) for each in steps] == [
        ("talker-1", "configure", "configuring"),
        ("talker-1", "transition_success", "inactive"),
        ("talker-1", "activate", "activating"),
        ("talker-1", "transition_success", "active"),
    ]
    assert all(isinstance(each["pid"], int) for each in steps)
    appeared = [each for each in map(json.loads, program.lines) if each["event"] == "appeared"]
    assert not [each for each in appeared if each["name"].startswith("/_launch")]


async def test_autostart_follows_each_start(system: System, tmp_path: Path) -> None:
    """A node that was killed and respawned is configured and activated again."""
    actions = (
        STEP.format("activating", "active", "LogInfo(msg='it is up')"),
        f"{NODE}, autostart=True, respawn=True)",
    )
    program = await start_launch(system, launch_file(tmp_path, *actions, talker=TALKER))
    pid = int((await program.find_line("] configuring ")).split()[-1])
    await program.find_line("it is up")
    os.kill(pid, signal.SIGKILL)
    await program.wait_for_line("process has died")
    await program.wait_for_line("[talker-1] configuring ")
    await program.wait_for_line("it is up")
    assert await program.stop() == 0
    assert "Failed to make transition" not in program.output


@pytest.mark.parametrize(("word", "goal"), [("fail", "unconfigured"), ("raise", "errorprocessing")])
async def test_a_failed_transition_is_logged(system: System, tmp_path: Path, word: str, goal: str) -> None:
    """Handlers hear of it; the launch goes on, and has not failed."""
    actions = (
        STEP.format("configuring", goal, "LogInfo(msg='it cannot be configured')"),
        f"{NODE}, arguments=['{word}'], autostart=True)",
    )
    program = await start_launch(system, launch_file(tmp_path, *actions, talker=TALKER))
    await program.find_line("it cannot be configured")
    failed = "Failed to make transition 'configure' for LifecycleNode '/talker'; not requested: activate"
    await program.find_line(f"[ERROR] [talker-1]: {failed}")
    assert await program.stop() == 0


async def test_a_node_that_dies_ends_its_transition(system: System, tmp_path: Path) -> None:
    """With a line that says so, and an exit code of the launch for the process."""
    actions = (f"{NODE}, arguments=['hang'], autostart=True)",)
    program = await start_launch(system, launch_file(tmp_path, *actions, talker=TALKER))
    os.kill(int((await program.find_line("] configuring ")).split()[-1]), signal.SIGKILL)
    await program.find_line(
        "[ERROR] [talker-1]: Failed to make transition 'configure' for LifecycleNode '/talker': "
    )
    assert await program.wait_for_exit() == 1
    assert "Traceback" not in program.output


async def test_ctrl_c_ends_a_transition(system: System, tmp_path: Path) -> None:
    """The launch does not wait for the callback's end."""
    actions = (f"{NODE}, arguments=['hang'], autostart=True)",)
    program = await start_launch(system, launch_file(tmp_path, *actions, talker=TALKER))
    pid = int((await program.find_line("] configuring ")).split()[-1])
    assert await program.stop() == 0
    assert "Abandoning wait for the '/talker/change_state' service, due to shutdown." in program.output
    assert not is_alive(pid)


async def test_a_broker_that_dies_ends_a_transition(system: System, tmp_path: Path) -> None:
    """With a line that says so; the launch and the node go on."""
    broker = await system.broker()
    actions = (f"{NODE}, arguments=['hang'], autostart=True)",)
    program = await start_launch(system, launch_file(tmp_path, *actions, talker=TALKER))
    await program.find_line("] configuring ")
    broker.send_signal(signal.SIGKILL)
    await program.find_line(
        "[ERROR] [talker-1]: Failed to make transition 'configure' for LifecycleNode '/talker': "
    )
    assert await program.stop() == 0


async def test_a_node_in_the_launchs_process_has_transitions(system: System, tmp_path: Path) -> None:
    """A node in the launch's own process is configured and activated, as one in a process of its own."""
    (tmp_path / "own.launch.py").write_text(
        "from actors import LifecycleNode as Node\n"
        "from actors.launch import LaunchDescription, LifecycleNode, LogInfo, OnStateTransition\n"
        "from actors.launch import RegisterEventHandler, Shutdown\n\n"
        "def make():\n    return Node('own')\n\n"
        "def generate_launch_description():\n"
        "    up = OnStateTransition(goal_state='active', entities=[LogInfo(msg='up'), Shutdown()])\n"
        "    own = LifecycleNode(node=make, name='own', autostart=True)\n"
        "    return LaunchDescription([RegisterEventHandler(up), own])\n"
    )
    program = await start_launch(system, str(tmp_path / "own.launch.py"))
    assert await program.wait_for_exit() == 0
    assert "[INFO] [launch]: up" in program.lines


async def test_a_launch_without_lifecycle_nodes_imports_nothing_for_them(system: System) -> None:
    """A launch without lifecycle nodes imports neither their client nor their messages."""
    source = (
        "import asyncio, sys\n"
        "from actors.launch import ExecuteProcess, Launch, LaunchDescription\n"
        "launch = Launch(LaunchDescription([ExecuteProcess(cmd=['true'])]))\n"
        "asyncio.run(launch.run())\n"
        "print([name for name in sys.modules if 'lifecycle_msgs' in name or 'transition_client' in name])\n"
    )
    program = await system.python("-c", source, forked=False)
    assert await program.wait_for_exit() == 0
    assert program.lines == ["[]"]
