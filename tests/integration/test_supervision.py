"""Supervised processes are restarted, are always stopped, and do not outlive their supervisor."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import textwrap
from typing import TYPE_CHECKING

import pytest

import actors
from actors import Child, ChildEventKind, ChildState, Supervisor
from actors.interfaces.std_msgs.msg import UInt32
from tests.integration.conftest import DEADLINE_SEC
from tests.integration.processes import DEAF, PARENT, SLEEPER, is_alive, pids_in, wait_until_dead
from tests.seams.processes import close_guard_pipe, guard_process

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import Program, System

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

SUPERVISE = """
import actors
actors.run(lambda: actors.Supervisor([{children}], restart_window_sec=60))
"""

NEST = """
import actors

def inner():
    return actors.Supervisor([actors.Child("deep", script={path!r}, stop_timeout_sec=1000)])

children = [actors.Child("inner", node=inner, stop_timeout_sec=1000)]
children.append(actors.Child("c1", script={path!r}, stop_timeout_sec=1000))
actors.run(lambda: actors.Supervisor(children))
"""


def script(folder: Path, name: str, source: str) -> str:
    """Write a script; return its path."""
    path = folder / f"{name}.py"
    path.write_text(textwrap.dedent(source))
    return str(path)


async def supervise(system: System, *scripts: str, options: str = "") -> Program:
    """Start a process that supervises these scripts."""
    children = ", ".join(
        f"actors.Child({f'c{i}'!r}, script={path!r}{options})" for i, path in enumerate(scripts)
    )
    return await system.python("-c", SUPERVISE.format(children=children))


async def test_a_killed_script_is_restarted(tmp_path: Path) -> None:
    """The events name SIGKILL, and the script runs again with another pid."""
    sleeper = script(tmp_path, "sleeper", SLEEPER)
    async with Supervisor([Child("s", script=sleeper)]) as supervisor:
        events = supervisor.events()
        async with asyncio.timeout(DEADLINE_SEC):
            first = await anext(events)
            assert first.kind is ChildEventKind.STARTED
            assert first.pid is not None
            os.kill(first.pid, signal.SIGKILL)
            died, waits, again = [await anext(events) for _ in range(3)]
        assert died.outcome is not None
        assert (died.reason, died.outcome.signal_name, died.pid) == (
            "killed by SIGKILL",
            "SIGKILL",
            first.pid,
        )
        assert waits.kind is ChildEventKind.RESTARTING
        assert (again.kind, again.restarts) == (ChildEventKind.STARTED, 1)
        assert again.pid not in (None, first.pid)
        (status,) = supervisor.children()
        assert (status.pid, status.state) == (again.pid, ChildState.RUNNING)
    await wait_until_dead(again.pid or 0)


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("raise SystemExit(7)", "exit code 7"),
        ("import os; os.kill(os.getpid(), 11)", "killed by SIGSEGV"),
        (None, "exit code 127"),
    ],
)
async def test_a_script_that_dies_at_once_is_given_up(
    tmp_path: Path, source: str | None, reason: str
) -> None:
    """After its last restart the supervisor raises an error with the reason; also for a missing command."""
    child = (
        Child("c", command=["/no/such/command"])
        if source is None
        else Child("c", script=script(tmp_path, "short", source))
    )
    with pytest.raises(actors.SupervisorGaveUp, match=f"'c' died too often, last: {reason}"):
        await Supervisor([child], max_restarts=2, restart_window_sec=60).run()


async def test_a_missing_folder_is_a_reason(tmp_path: Path) -> None:
    """A process that cannot be started counts as a child that failed."""
    child = Child("c", command=["true"], cwd=tmp_path / "none")
    with pytest.raises(actors.SupervisorGaveUp, match="FileNotFoundError"):
        await Supervisor([child], max_restarts=1, restart_window_sec=60).run()


async def test_arguments_environment_and_folder_reach_the_process(tmp_path: Path) -> None:
    """args, env and cwd are passed on, and the rest of the environment is inherited."""
    source = """
        import os, sys
        good = sys.argv[1:] == ["a b", "$c"] and os.environ["MINE"] == "x y" and "PATH" in os.environ
        here = os.path.samefile(os.getcwd(), os.path.dirname(sys.argv[0]))
        sys.exit(0 if good and here and not sys.stdin.read() else 1)
    """
    child = Child(
        "c",
        script=script(tmp_path, "look", source),
        args=("a b", "$c"),
        env={"MINE": "x y"},
        cwd=tmp_path,
        restart=actors.Restart.TRANSIENT,
    )
    await Supervisor([child], max_restarts=0).run()


@pytest.mark.parametrize("very", [False, True])
async def test_children_that_ignore_signals_are_stopped(
    system: System, tmp_path: Path, *, very: bool
) -> None:
    """One that ignores SIGINT gets SIGTERM; one that ignores both gets SIGKILL."""
    more = "signal.signal(signal.SIGTERM, signal.SIG_IGN)" if very else ""
    deaf = script(tmp_path, "deaf", DEAF.format(more=more))
    boss = await supervise(system, deaf, options=", stop_timeout_sec=0.2")
    (pid,) = pids_in(await boss.wait_for_line("deaf "))
    assert await boss.stop() == 0
    assert not is_alive(pid)
    assert "has not ended after SIGINT; sending SIGTERM" in boss.output
    assert ("Child 'c0' died: killed by SIGKILL" in boss.output) is very


async def test_the_children_of_a_killed_child_end_before_its_restart(system: System, tmp_path: Path) -> None:
    """The rest of its process group is killed."""
    boss = await supervise(system, script(tmp_path, "parent", PARENT))
    pid, grandchild = pids_in(await boss.wait_for_line("parent "))
    os.kill(pid, signal.SIGKILL)
    pid2, grandchild2 = pids_in(await boss.wait_for_line("parent "))
    await wait_until_dead(pid, grandchild)
    assert is_alive(pid2)
    assert await boss.stop() == 0
    await wait_until_dead(pid2, grandchild2)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_signals_stop_everything(system: System, tmp_path: Path, number: signal.Signals) -> None:
    """The supervising script exits with 0, without a traceback, and no process is left."""
    node = """
        import actors, os

        class Node(actors.Node):
            def __init__(self):
                super().__init__("n%d" % os.getpid())
                self.create_timer(0.01, self.say)
                self.said = False

            def say(self):
                if not self.said:
                    self.said = True
                    os.write(1, b"node %d\\n" % os.getpid())

        actors.run(Node)
    """
    path = script(tmp_path, "node", node)
    boss = await supervise(system, path, path)
    pids = [*pids_in(await boss.wait_for_line("node ")), *pids_in(await boss.wait_for_line("node "))]
    boss.send_signal(number)
    assert await boss.wait_for_exit() == 0
    assert "Traceback" not in boss.output
    assert boss.output.count("ended: stopped by its supervisor") == 2
    assert not any(is_alive(pid) for pid in pids)


@pytest.mark.parametrize("nested", [False, True])
async def test_a_second_signal_kills(system: System, tmp_path: Path, *, nested: bool) -> None:
    """Children that are slow to stop are killed, also those of a nested supervisor."""
    busy = DEAF.format(more='signal.signal(signal.SIGINT, lambda *_: os.write(1, b"asked\\n"))')
    deaf = script(tmp_path, "busy", busy)
    if nested:
        boss = await system.python("-c", NEST.format(path=deaf))
    else:
        boss = await supervise(system, deaf, deaf, options=", stop_timeout_sec=1000")
    pids = [*pids_in(await boss.wait_for_line("deaf ")), *pids_in(await boss.wait_for_line("deaf "))]
    boss.send_signal(signal.SIGINT)
    await boss.wait_for_line("asked")
    boss.send_signal(signal.SIGINT)
    assert await boss.wait_for_exit() == 0
    assert "Traceback" not in boss.output
    assert "cannot be stopped" not in boss.output
    assert not any(is_alive(pid) for pid in pids)


async def test_giving_up_is_one_line_and_exit_code_1(system: System, tmp_path: Path) -> None:
    """A supervising script that gives up prints the reason and exits with 1."""
    boss = await supervise(system, script(tmp_path, "short", "raise SystemExit(3)"))
    assert await boss.wait_for_exit() == 1
    assert boss.lines[-1].endswith("gave up: 'c0' died too often, last: exit code 3")
    assert "Traceback" not in boss.output


@pytest.mark.parametrize("group", [False, True])
async def test_no_process_survives_a_killed_supervisor(
    system: System, tmp_path: Path, *, group: bool
) -> None:
    """After SIGKILL of it, or of its group, children, their children and the guard end."""
    boss = await supervise(system, script(tmp_path, "sleeper", SLEEPER), script(tmp_path, "parent", PARENT))
    pids = [pid for text in ("sleeper", "parent") for pid in pids_in(await boss.find_line(f"{text} "))]
    assert len(pids) == 3
    everyone = [*pids, *children_of(boss.process.pid)]
    assert len(set(everyone)) >= (4 if sys.platform == "linux" else 3)
    (os.killpg if group else os.kill)(boss.process.pid, signal.SIGKILL)
    await boss.wait_for_exit()
    await wait_until_dead(*everyone)


def children_of(pid: int) -> list[int]:
    """Return a process's children, on systems that list them."""
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:  # noqa: PTH123 - in a line
            return [int(word) for word in file.read().split()]
    except FileNotFoundError:
        return []


async def test_a_guard_that_was_killed_is_replaced(tmp_path: Path) -> None:
    """The next start of a child starts a guard that also knows the earlier children."""
    pipes = [tmp_path / name for name in "ab"]
    for pipe in pipes:
        os.mkfifo(pipe)
    says = "echo >{}; exec sleep 1000"
    children = [Child(pipe.name, command=["/bin/sh", "-c", says.format(pipe)]) for pipe in pipes]
    async with Supervisor(children) as supervisor, asyncio.timeout(DEADLINE_SEC):
        await supervisor.wait_for("b", ChildState.RUNNING)
        for pipe in pipes:  # a child that writes has been registered with the guard before
            await asyncio.to_thread(pipe.read_bytes)
        a, _ = supervisor.children()
        assert a.pid is not None
        guard = guard_process(supervisor)
        assert guard is not None
        guard.signal(signal.SIGKILL)
        await guard.wait()
        events = supervisor.events()
        os.kill(a.pid, signal.SIGKILL)
        async for event in events:
            if event.kind is ChildEventKind.STARTED:
                break
        fresh = guard_process(supervisor)
        assert fresh is not guard
        # As if the supervisor had been killed: the pipe closes.
        close_guard_pipe(supervisor)
        assert fresh is not None
        await fresh.wait()
        both = [await anext(events) for _ in range(2)]
        assert {each.reason for each in both} <= {"killed by SIGKILL"}


async def test_a_fork_of_the_supervisor_does_not_keep_the_guard_waiting(
    system: System, tmp_path: Path
) -> None:
    """A forked process without exec does not hold the pipe to the guard."""
    source = f"""
        import actors, asyncio, os, time

        async def main():
            child = actors.Child("s", script={script(tmp_path, "sleeper", SLEEPER)!r})
            async with actors.Supervisor([child]) as supervisor:
                await supervisor.wait_for("s", actors.ChildState.RUNNING)
                if os.fork() == 0:
                    os.write(1, b"fork %d\\n" % os.getpid())
                    time.sleep(1000)
                await asyncio.Event().wait()

        actors.run(main)
    """
    boss = await system.python("-W", "ignore", script(tmp_path, "boss", source))
    sleeper = pids_in(await boss.find_line("sleeper "))
    fork = pids_in(await boss.find_line("fork "))
    os.kill(boss.process.pid, signal.SIGKILL)
    await wait_until_dead(*sleeper)
    assert is_alive(fork[0])
    os.kill(fork[0], signal.SIGKILL)


async def test_a_killed_node_publishes_again(system: System, tmp_path: Path) -> None:
    """A node in a killed process publishes again after its restart."""
    await system.broker()
    publisher = """
        import actors
        from actors.interfaces.std_msgs.msg import UInt32

        class Talker(actors.Node):
            def __init__(self):
                super().__init__("talker")
                self.publisher = self.create_publisher(UInt32, "pids", 10)
                self.create_timer(0.05, self.say)

            def say(self):
                import os
                self.publisher.publish(UInt32(data=os.getpid()))

        actors.run(Talker)
    """
    child = Child("talker", script=script(tmp_path, "talker", publisher), env={"CALLBOARD_URL": system.url})
    listener = actors.Node("listener", url=system.url)
    pids = listener.create_subscription(UInt32, "pids")
    async with listener, Supervisor([child]), asyncio.timeout(DEADLINE_SEC):
        first = (await anext(aiter(pids))).data
        os.kill(first, signal.SIGKILL)
        while (await anext(aiter(pids))).data == first:
            pass
