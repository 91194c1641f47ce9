"""Nodes in the launch's process: each with its own arguments, broker, environment and lines."""

# ruff: noqa: T201 - printing is what is tested

from __future__ import annotations

import asyncio
import contextvars
import io
import logging
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.arguments.ros_arguments import process_arguments
from actors.config import environment
from actors.interfaces.std_srvs.srv import Empty
from actors.launch.engine.captured_output import (
    MAX_WAITING_BYTES,
    CapturedOutput,
    captured_logs,
    captured_streams,
    launch_logs,
)
from actors.launch.engine.node_execution import NodeExecution
from actors.launch.planning.events import Message, ProcessIO, Stream
from actors.launch.planning.process_spec import ProcessSpec
from actors.logging.logger import get_logger
from actors.logging.severity import LoggingSeverity
from actors.processes import execution as execution_module
from tests.actors.meeting import until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.launch.planning.events import Event
    from actors.processes.outcome import Outcome
    from tests.actors.meeting import Meeting


class Hall:
    """Where executions run and are recorded."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.context = contextvars.copy_context()
        self._numbers = 0

    def execution(
        self, program: Any, *arguments: str, stop_timeout_sec: float = 5.0, **options: Any
    ) -> tuple[NodeExecution, asyncio.Future[Outcome]]:
        """Start an execution; return it and how it ends."""
        self._numbers += 1
        spec = ProcessSpec(
            label=f"node-{self._numbers}",
            name="node",
            program=program,
            command=arguments,
            shown="node",
            **options,
        )
        ended: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        execution = NodeExecution(
            spec,
            write=lambda stream, lines: self.events.append(ProcessIO(spec, None, stream, tuple(lines))),
            on_message=lambda level, text: self.events.append(Message(level, text, spec.label)),
            stop_timeout_sec=stop_timeout_sec,
            on_started=lambda: None,
            on_ended=ended.set_result,
        )
        execution.start(self.context)
        return execution, ended

    def lines(self, label: str, stream: Stream | None = None) -> list[str]:
        """Return what has come from one node."""
        return [
            line.decode()
            for event in self.events
            if isinstance(event, ProcessIO) and event.process.label == label
            if stream in (None, event.stream)
            for line in event.lines
        ]

    def messages(self) -> list[str]:
        """Return what was reported, and about whom."""
        return [f"{each.about}: {each.text}" for each in self.events if isinstance(each, Message)]


@pytest.fixture
def hall() -> Iterator[Hall]:
    """Return a place for executions whose log is captured."""
    made = Hall()
    yield made
    assert process_arguments.get() is None
    assert environment.stand_in.get() is None


class Talker(actors.Node):
    """Says who it is when its timer rings."""

    def __init__(self) -> None:
        super().__init__("talker")
        self.declare_parameter("word", "hello")
        self.create_timer(0.0, self._ring)

    def _ring(self) -> None:
        self.get_logger().info(f"{self.get_fully_qualified_name()} says {self.get_parameter('word').value}")


async def test_nodes_have_their_own_arguments_and_the_launchs_broker(hall: Hall, meeting: Meeting) -> None:
    """Two runs of a class are two nodes of the graph; what they log from callbacks is under their labels."""
    there = {"CALLBOARD_URL": meeting.url}
    looking = await meeting.node("looking")
    with captured_logs(), launch_logs(hall.events.append):
        first, first_end = hall.execution(
            Talker,
            "--ros-args",
            "-r",
            "__node:=anna",
            "-r",
            "__ns:=/ns1",
            "-p",
            "word:=hi",
            environment=there,
        )
        second, second_end = hall.execution(Talker, environment=there)
        await until(lambda: hall.lines("node-1") and hall.lines("node-2"))
        while not {"/ns1/anna", "/talker"} <= set(await looking.get_fully_qualified_node_names()):
            await asyncio.sleep(0)
        first.stop()
        second.stop()
        assert (await first_end).normal
        assert (await second_end).normal
    assert hall.lines("node-1")[0].endswith("[ns1.anna]: /ns1/anna says hi")
    assert hall.lines("node-2")[0].endswith("[talker]: /talker says hello")


async def test_the_environment_is_the_specifications(hall: Hall) -> None:
    """As far as callboard reads it; os.environ stays as it is."""
    seen: list[object] = []

    async def look() -> None:
        seen.extend((environment.domain_id(), (environment.environment_for({}) or {}).get("MINE")))
        seen.append(await asyncio.to_thread(environment.domain_id))

    _, ended = hall.execution(look, environment={"CALLBOARD_DOMAIN": "7", "MINE": "yes"})
    assert (await ended).normal
    assert seen == [7, "yes", 7]


async def test_a_class_that_raises_is_a_death(hall: Hall) -> None:
    """The outcome has the reason, its output where it was."""

    def broken() -> actors.Node:
        raise ValueError("no such map")

    with captured_logs(), launch_logs(hall.events.append):
        _, ended = hall.execution(broken)
        outcome = await ended
    assert (outcome.normal, outcome.reason) == (False, "ValueError: no such map")
    lines = hall.lines("node-1", Stream.STDERR)
    assert lines[-1] == "ValueError: no such map"
    assert any("in broken" in line for line in lines)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--ros-args", "-r", "nonsense"), "InvalidRosArgumentError: "),
        (("--ros-args", "--params-file", "/no/such/file"), "InvalidRosArgumentError: "),
    ],
)
async def test_arguments_that_cannot_be_read_are_a_death(
    hall: Hall, arguments: tuple[str, ...], reason: str
) -> None:
    """As they are for a script; one line says what is wrong."""
    with captured_logs(), launch_logs(hall.events.append):
        _, ended = hall.execution(Talker, *arguments)
        outcome = await ended
    assert not outcome.normal
    assert outcome.reason.startswith(reason)
    assert hall.events == []


@pytest.mark.parametrize(("status", "code", "lines"), [(3, 3, 0), (None, 0, 0), ("no map", 1, 1)])
async def test_an_exit_ends_the_node_only(hall: Hall, status: Any, code: int, lines: int) -> None:
    """`sys.exit` in a node's own coroutine is its end, with an exit code as a process has it."""

    async def leave() -> None:
        sys.exit(status)

    with captured_logs(), launch_logs(hall.events.append):
        _, ended = hall.execution(leave)
        outcome = await ended
    assert (outcome.normal, outcome.exit_code, outcome.returncode) == (code == 0, code, code)
    assert len(hall.lines("node-1")) == lines


async def test_an_exit_in_a_supervisors_child_ends_the_supervisor_only(hall: Hall, meeting: Meeting) -> None:
    """It is meant for all that runs there, and for no more; asyncio does not leave its loop for it."""

    class Quitter(actors.Node):
        def __init__(self) -> None:
            super().__init__("quitter")
            self.create_timer(0.0, lambda: sys.exit(3))

    def made() -> actors.Supervisor:
        return actors.Supervisor([actors.Child("q", node=Quitter)])

    with captured_logs(), launch_logs(hall.events.append):
        _, ended = hall.execution(made, environment={"CALLBOARD_URL": meeting.url})
        outcome = await ended
    assert outcome.returncode == 3


class Leaver(actors.Node):
    """Leaves when it is called, with a timer that rings on."""

    def __init__(self, *, waits: bool) -> None:
        super().__init__("leaver")
        self.rings = 0
        self.left = 0
        self.create_service(Empty, "leave", self._leave_late if waits else self._leave)
        self.create_timer(0.0, self._ring)

    def _leave(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        del request, response
        self.left += 1
        sys.exit(3)

    async def _leave_late(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        await asyncio.sleep(0)
        return self._leave(request, response)

    def _ring(self) -> None:
        assert not self.left
        self.rings += 1


@pytest.mark.parametrize("waits", [False, True])
async def test_an_exit_in_a_callback_ends_the_node_only(hall: Hall, meeting: Meeting, *, waits: bool) -> None:
    """With its exit code, and nothing of it begins after that; the other node lives on."""
    there = {"CALLBOARD_URL": meeting.url}
    asking = await meeting.node("asking")
    with captured_logs(), launch_logs(hall.events.append):
        other, other_end = hall.execution(Talker, environment=there)
        nodes: list[Leaver] = []

        def made() -> Leaver:
            nodes.append(Leaver(waits=waits))
            return nodes[-1]

        _, ended = hall.execution(made, environment=there)
        client = asking.create_client(Empty, "leave")
        assert await client.wait_for_service(10)
        await until(lambda: nodes[0].rings)
        calls = [client.call_async(Empty.Request()) for _ in range(2)]
        outcome = await ended
        await asyncio.wait([asyncio.ensure_future(call) for call in calls])
        assert not other_end.done()
        other.stop()
        await other_end
    assert (outcome.exit_code, nodes[0].left) == (3, 1)
    assert nodes[0].callback_errors == 0


async def test_a_log_level_is_for_that_node(hall: Hall, meeting: Meeting) -> None:
    """From its arguments, or from its environment."""
    levels: list[LoggingSeverity] = []

    class Quiet(actors.Node):
        def __init__(self) -> None:
            super().__init__("quiet_in_launch")
            self.create_timer(0.0, lambda: levels.append(self.get_logger().get_effective_level()))

    there = {"CALLBOARD_URL": meeting.url}
    try:
        for arguments, variables in [
            (("--ros-args", "--log-level", "ERROR"), there),
            ((), {**there, "CALLBOARD_LOG_LEVEL": "debug"}),
        ]:
            levels.clear()
            execution, ended = hall.execution(Quiet, *arguments, environment=variables)
            await until(lambda: levels)
            execution.stop()
            await ended
            wanted = LoggingSeverity.ERROR if arguments else LoggingSeverity.DEBUG
            assert levels[0] is wanted
    finally:
        get_logger("quiet_in_launch").set_level(LoggingSeverity.UNSET)


async def test_what_it_prints_is_its_output(hall: Hall, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines on their streams, in their order, the last one also without an end; from threads, too."""
    beyond = io.StringIO()
    monkeypatch.setattr(sys, "stdout", beyond)

    async def chatter() -> None:
        print("one", end=" ")
        await asyncio.sleep(0)
        print("line")
        print("bad", file=sys.stderr)
        print("again")
        sys.stdout.buffer.write(b"bytes\n")
        await asyncio.to_thread(print, "threaded")
        assert not sys.stdout.isatty()
        print("no end", end="")

    with captured_streams():
        _, ended = hall.execution(chatter)
        print("the launch's own")
        await ended
        print("is not held up")
    assert sys.stdout is beyond
    assert beyond.getvalue() == "the launch's own\nis not held up\n"
    assert hall.lines("node-1", Stream.STDOUT) == ["one line", "again", "bytes", "threaded", "no end"]
    assert hall.lines("node-1", Stream.STDERR) == ["bad"]
    assert hall.lines("node-1")[:3] == ["one line", "bad", "again"]


async def test_what_is_written_after_its_end_is_the_launchs(
    hall: Hall, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A task that a node has left behind has no label any more."""
    beyond = io.StringIO()
    monkeypatch.setattr(sys, "stdout", beyond)
    left: list[asyncio.Task[None]] = []
    go_on = asyncio.Event()

    async def later() -> None:
        await go_on.wait()
        print("late")

    async def leave() -> None:
        left.append(asyncio.get_running_loop().create_task(later()))

    with captured_streams():
        _, ended = hall.execution(leave)
        await ended
        go_on.set()
        await left[0]
    assert beyond.getvalue() == "late\n"
    assert hall.events == []


async def test_others_log_for_the_launch(hall: Hall) -> None:
    """What is logged elsewhere in the process is a message, from threads, too."""
    with captured_logs(), launch_logs(hall.events.append):
        get_logger("launch").info("no broker there")
        thread = threading.Thread(target=logging.getLogger("library").error, args=("bad\x1b[2J",))
        thread.start()
        await until(lambda: len(hall.events) == 2)
        thread.join()
    assert hall.messages() == ["launch: no broker there", r"library: bad\x1b[2J"]
    assert [each.level.value for each in hall.events if isinstance(each, Message)] == ["INFO", "ERROR"]


async def test_a_log_call_that_is_wrong_does_not_fail(hall: Hall, capsys: pytest.CaptureFixture[str]) -> None:
    """As everywhere it is reported where errors go."""
    wrong = logging.LogRecord("library", logging.ERROR, "file.py", 1, "%d", ("no number",), None)

    async def log() -> None:
        for handler in logging.getLogger().handlers[-2:]:  # pytest's own raise
            handler.handle(wrong)

    with captured_logs(), launch_logs(hall.events.append):
        _, ended = hall.execution(log)
        assert (await ended).normal
        await log()
    assert hall.events == []
    assert capsys.readouterr().err.count("real number is required") == 2


async def test_what_comes_too_fast_is_dropped_and_counted(hall: Hall) -> None:
    """A node that holds the loop cannot fill the memory with lines."""
    line = b"x" * 1023 + b"\n"
    fits = MAX_WAITING_BYTES // len(line)

    async def flood() -> None:
        captured = CapturedOutput.current()
        assert captured is not None
        for _ in range(fits + 5):
            captured.write(Stream.STDOUT, line)
        assert captured.lost_lines == 5
        await asyncio.sleep(0)
        captured.write(Stream.STDOUT, b"after\n")

    _, ended = hall.execution(flood)
    assert (await ended).normal
    assert len(hall.lines("node-1")) == fits + 1
    assert hall.messages() == ["node-1: node has written too fast: 5 lines are not shown"]


async def test_a_deaf_node_is_cancelled_again(hall: Hall) -> None:
    """After its own time; the launch's would be too long for this test."""
    begun = asyncio.Event()

    async def deaf() -> None:
        try:
            begun.set()
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            await asyncio.Event().wait()

    execution, ended = hall.execution(deaf, stop_timeout_sec=1000, sigterm_timeout_sec=0.05)
    await begun.wait()
    execution.stop()
    assert (await ended).normal
    assert hall.messages() == ["node-1: node has not stopped yet; cancelling it again"]


@pytest.mark.parametrize("forced", ["", "at once", "late"])
async def test_a_node_that_cannot_be_stopped_is_given_up(
    hall: Hall, monkeypatch: pytest.MonkeyPatch, forced: str
) -> None:
    """After its own time from the second cancellation on, or soon when the stop is forced, then or before."""
    monkeypatch.setattr(execution_module, "LAST_STEP_SEC", 0.05 if forced else 1000)
    begun, released = asyncio.Event(), asyncio.Event()

    async def stubborn() -> None:
        begun.set()
        while not released.is_set():
            with suppress(asyncio.CancelledError):
                await released.wait()

    times = {"sigterm_timeout_sec": 0.05, "sigkill_timeout_sec": 1000 if forced else 0.05}
    execution, ended = hall.execution(stubborn, stop_timeout_sec=1000, **times)
    await begun.wait()
    execution.stop()
    if forced == "late":
        await until(hall.messages)
    if forced:
        execution.force_stop()
    assert (await ended).reason == "could not be stopped"
    assert hall.messages()[-1] == "node-1: node cannot be stopped; going on without it"
    released.set()
    await asyncio.wait(asyncio.all_tasks() - {asyncio.current_task()})


async def test_what_listeners_set_stays_with_them(hall: Hall) -> None:
    """Nodes that are started later do not inherit it."""
    mark = contextvars.ContextVar[str]("mark")
    hall.events = Marked(mark)

    async def chatter() -> None:
        captured = CapturedOutput.current()
        assert captured is not None
        captured.write(Stream.STDOUT, b"hello\n")
        await asyncio.sleep(0)

    _, ended = hall.execution(chatter)
    await ended
    assert hall.lines("node-1") == ["hello"]
    assert mark not in hall.context


class Marked(list["Event"]):
    """Events, and a mark in the context of whoever adds one."""

    def __init__(self, mark: contextvars.ContextVar[str]) -> None:
        super().__init__()
        self._mark = mark

    def append(self, event: Event) -> None:
        """Add one."""
        self._mark.set("marked")
        super().append(event)
