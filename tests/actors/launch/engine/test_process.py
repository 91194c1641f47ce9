"""A process of the launch: how it is stopped, and what is said of that."""

from __future__ import annotations

import asyncio
import contextvars
import gc
import os
import signal
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.engine import process as module
from actors.launch.engine.process import LaunchedProcess
from actors.launch.planning.events import Stream
from actors.launch.planning.process_spec import ProcessSpec
from actors.processes import execution, process_execution
from actors.processes.guard import Guard
from actors.processes.process import Process
from proto.aio import process
from tests.seams.processes import child_process

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from actors.launch.planning.events import Level
    from actors.processes.outcome import Outcome

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A killed process may end late, because the machine pauses."""
    monkeypatch.setattr(execution, "LAST_STEP_SEC", 1000)
    monkeypatch.setattr(process_execution, "LAST_STEP_SEC", 1000)


DEAF = "trap '' INT TERM; echo deaf; while :; do sleep 1000; done"


class Run:
    """One run of a shell script.

    Attributes:
        process: The process.
        output: What it has written.
        streams: Where it has written.
        outcome: How it ends.
    """

    def __init__(
        self,
        guard: Guard,
        script: str,
        *,
        split: bool = False,
        stop_timeout_sec: float = 1000,
        on_message: Callable[[Level, str], None] | None = None,
        **options: Any,
    ) -> None:
        command = ("/bin/sh", "-c", script)
        spec = ProcessSpec(
            label="script-1",
            name="script",
            command=command,
            shown="script",
            environment=os.environ,
            **options,
        )
        self.output = b""
        self.streams: set[Stream] = set()
        self.said: list[str] = []
        self._more = asyncio.Event()
        self.outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self.process = LaunchedProcess(
            spec,
            guard,
            split=split,
            write=self._write,
            on_message=on_message or (lambda level, text: self.said.append(f"{level.value} {text}")),
            stop_timeout_sec=stop_timeout_sec,
            on_started=lambda: None,
            on_ended=self.outcome.set_result,
        )
        self.process.start(contextvars.copy_context())

    async def says(self, text: bytes) -> None:
        """Wait for something in its output."""
        while text not in self.output:
            self._more.clear()
            await self._more.wait()

    def _write(self, stream: Stream, lines: Sequence[bytes]) -> None:
        self.streams.add(stream)
        self.output += b"".join(line + b"\n" for line in lines)
        self._more.set()


async def test_each_signal_has_a_wait_of_its_own() -> None:
    """The launch's wait would be too long for this test; what has happened is reported as of a process."""
    guard = Guard()
    run = Run(guard, DEAF, sigterm_timeout_sec=0.05, sigkill_timeout_sec=0.1)
    await run.says(b"deaf")
    run.process.stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert run.said == [
        "WARN process has not ended after SIGINT; sending SIGTERM",
        "WARN process has not ended after SIGTERM; sending SIGKILL",
    ]


async def test_the_launchs_wait_stands_in() -> None:
    """For each wait that the process does not have itself."""
    guard = Guard()
    run = Run(guard, DEAF, stop_timeout_sec=0.05)
    await run.says(b"deaf")
    run.process.stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert len(run.said) == 2


async def test_a_forced_stop_kills_the_process_at_once() -> None:
    """Nothing is said of signals that it never got."""
    guard = Guard()
    run = Run(guard, DEAF)
    await run.says(b"deaf")
    run.process.force_stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert run.said == ["WARN process is killed"]


SEES = "test -t 1 && test -t 2 && echo terminal; echo more >&2; printf 'no end'"


@pytest.mark.parametrize("split", [True, False])
@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, process.new_event_loop])
def test_it_can_write_to_a_terminal(new_loop: Callable[[], Any], *, split: bool) -> None:
    """Or to two, where its streams are told apart; all of it has come when it has ended."""

    async def main() -> None:
        guard = Guard()
        run = Run(guard, SEES, split=split, emulate_tty=True)
        assert (await run.outcome).normal
        await guard.close()
        assert set(run.output.splitlines()) == {b"terminal", b"more", b"no end"}
        assert run.streams == ({Stream.STDOUT, Stream.STDERR} if split else {Stream.OUTPUT})

    with asyncio.Runner(loop_factory=new_loop) as runner:
        runner.run(main())


@pytest.mark.parametrize("emulate_tty", [True, False])
async def test_its_end_does_not_wait_for_who_has_left(tmp_path: Path, *, emulate_tty: bool) -> None:
    """A process in a session of its own may hold the pipe or terminal open."""
    left = f"import os, time; os.setsid(); open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))"
    path = tmp_path / "pid"
    guard = Guard()
    script = f"""'{sys.executable}' -c "{left}; print('left', flush=True); time.sleep(1000)" & wait"""
    run = Run(guard, script, emulate_tty=emulate_tty)
    await run.says(b"left")
    run.process.force_stop()
    await run.outcome
    await guard.close()
    os.kill(int(path.read_text()), signal.SIGKILL)


async def test_a_suspended_process_can_end_properly() -> None:
    """It gets SIGTERM and goes on, so that it need not be killed."""
    script = "trap '' INT; trap 'echo ended; exit 0' TERM; echo ready; kill -s STOP $$; sleep 1000"
    guard = Guard()
    run = Run(guard, script, sigterm_timeout_sec=0.05)
    await run.says(b"ready")
    run.process.stop()
    outcome = await run.outcome
    await guard.close()
    assert outcome.exit_code == 0
    assert b"ended" in run.output


async def test_stopping_does_not_depend_on_who_listens() -> None:
    """A listener that raises keeps no signal from being sent."""
    errors: list[BaseException] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))

    def fail(level: Level, text: str) -> None:
        raise ValueError(text)

    guard = Guard()
    run = Run(guard, DEAF, stop_timeout_sec=0.05, on_message=fail)
    await run.says(b"deaf")
    run.process.stop()
    assert (await run.outcome).signal_name == "SIGKILL"
    await guard.close()
    assert [type(error) for error in errors] == [ValueError, ValueError]


@pytest.mark.parametrize("received", [True, False])
async def test_what_cannot_be_stopped_is_left(monkeypatch: pytest.MonkeyPatch, *, received: bool) -> None:
    """It has ended as far as the launch goes, and no task waits for it, whatever listeners do."""

    def fail(level: Level, text: str) -> None:
        raise ValueError(text)

    asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
    monkeypatch.setattr(execution, "LAST_STEP_SEC", 0.05)
    monkeypatch.setattr(process_execution, "LAST_STEP_SEC", 0.05)
    guard = Guard()
    run = Run(guard, "echo here; sleep 1000", stop_timeout_sec=0.05, on_message=None if received else fail)
    await run.says(b"here")
    child = child_process(run.process)
    with monkeypatch.context() as patch:
        patch.setattr(Process, "signal", lambda *_: None)  # as of another user's
        run.process.stop()
        assert (await run.outcome).reason == "could not be stopped"
        if others := asyncio.all_tasks() - {asyncio.current_task()}:
            await asyncio.wait(others)
    await guard.close()
    assert await child.wait() == -signal.SIGKILL
    assert not received or run.said[-1] == "ERROR process cannot be stopped; going on without it"


async def test_one_that_is_stopped_before_its_start_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody else can write to its pipes."""
    monkeypatch.setattr(module, "REST_TIMEOUT_SEC", 1000)
    run = Run(Guard(), DEAF)
    run.process.stop()
    assert (await run.outcome).normal
    assert run.process.pid is None


def descriptors() -> int:
    """Return how many descriptors this process has."""
    return len(os.listdir("/dev/fd"))  # noqa: PTH208 - a Path would open one more


async def test_the_ends_that_a_process_writes_to_are_its_own() -> None:
    """The launch has one descriptor for each of its streams, and a pidfd where the system has that."""
    guard = Guard()
    first = Run(guard, DEAF)  # the guard itself has some
    await first.says(b"deaf")
    gc.collect()  # what earlier tests have left
    before = descriptors()
    second = Run(guard, DEAF, split=True)
    await second.says(b"deaf")
    assert descriptors() == before + 2 + hasattr(os, "pidfd_open")
    for run in (first, second):
        run.process.force_stop()
        await run.outcome
    await guard.close()


async def test_a_pipe_that_cannot_be_read_leaves_nothing_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process is not started, and says why."""

    async def refuse(*_: object) -> None:
        raise OSError("no more pipes")

    before = descriptors()
    monkeypatch.setattr(asyncio.get_running_loop(), "connect_read_pipe", refuse)
    run = Run(Guard(), DEAF)
    assert "no more pipes" in (await run.outcome).reason
    assert descriptors() <= before  # what earlier tests have left may be closed meanwhile
