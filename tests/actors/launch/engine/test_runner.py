"""The runner carries out what the machine decides: executions here are made up, and end when told to."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.config.contexts import find_broker_target
from actors.launch.engine import runner as runner_module
from actors.launch.engine.machine import Machine
from actors.launch.engine.runner import Runner
from actors.launch.planning.events import Appeared, Event, ProcessIO, ProcessStarted, ShuttingDown, Stream
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.process_spec import ProcessSpec
from actors.launch.planning.steps import AddHandler, Start
from actors.processes.outcome import outcome_of_exit
from tests.seams.processes import timer_of

if TYPE_CHECKING:
    import contextvars
    from collections.abc import Callable

    from actors.launch.planning.steps import Step

ADD = Presence(PresenceKind.SERVICE, "/add")


class FakeExecution:
    """A process that is made up. `made` has all of them."""

    made: list[FakeExecution]

    def __init__(self, spec: ProcessSpec, *args: Any, **told: Any) -> None:
        self.spec = spec
        self.told = told
        self.pid = 7
        self.asked: list[str] = []
        self.obeys = True
        FakeExecution.made.append(self)

    def start(self, context: contextvars.Context) -> None:
        self.told["on_started"]()

    def stop(self) -> None:
        self.asked.append("stop")
        if self.obeys:
            asyncio.get_running_loop().call_soon(self.ends)

    def force_stop(self) -> None:
        self.asked.append("force_stop")
        asyncio.get_running_loop().call_soon(self.ends, -9)

    def ends(self, code: int = 0) -> None:
        self.told["on_ended"](outcome_of_exit(code))

    def writes(self, *lines: bytes) -> None:
        self.told["write"](Stream.OUTPUT, list(lines))


@pytest.fixture(autouse=True)
def _fake(monkeypatch: pytest.MonkeyPatch) -> None:
    FakeExecution.made = []
    monkeypatch.setattr(runner_module, "LaunchedProcess", FakeExecution)


def processes(names: str) -> list[Step]:
    """Return steps that start processes with these names."""
    return [
        Start(process=ProcessSpec(label=f"{name}-1", name=name, command=(name,), shown=name))
        for name in names
    ]


def of(*listeners: Callable[[Event], None]) -> Runner:
    """Return a runner."""
    target = find_broker_target()
    return Runner(Machine(), listeners, target=target, node_name="_launch_1", stop_timeout_sec=1)


async def test_it_ends_when_all_have_ended() -> None:
    """And what happened has been told in order."""
    told: list[str] = []
    running = asyncio.create_task(of(lambda event: told.append(type(event).__name__)).run(processes("ab")))
    await asyncio.sleep(0)
    first, second = FakeExecution.made
    first.writes(b"x")
    first.ends()
    second.ends(1)
    assert not await running
    assert told == [*["ProcessStarted"] * 2, "ProcessIO", *["ProcessExited"] * 2, "ShuttingDown"]


async def test_a_listener_may_stop_the_launch() -> None:
    """In the middle of starting: what has been started by then, and what is just being, is stopped."""

    def stop(event: Event) -> None:
        if isinstance(event, ProcessStarted):
            # Otherwise the second call would be a wish to kill, if the machine paused between the two.
            runner.stop("enough", escalate=False)

    told: list[Event] = []
    runner = of(stop, told.append)
    assert await runner.run(processes("ab"))
    assert [each.asked for each in FakeExecution.made] == [["stop"], ["stop"]]
    assert told.count(ShuttingDown("enough")) == 1


async def test_a_listener_that_fails_fails_the_launch() -> None:
    """Nothing is left running, and the error is raised to whoever runs it."""

    def fail(event: Event) -> None:
        if isinstance(event, ProcessIO):
            raise OSError("a bug")

    running = asyncio.create_task(of(fail).run(processes("ab")))
    await asyncio.sleep(0)
    first, second = FakeExecution.made
    first.writes(b"x")
    with pytest.raises(OSError, match="a bug"):
        await running
    assert (first.asked, second.asked) == (["stop"], ["stop"])


async def test_cancelling_it_stops_all_and_then_forces_them() -> None:
    """It is cancelled only when everything has ended."""
    runner = of()
    running = asyncio.create_task(runner.run(processes("a")))
    await asyncio.sleep(0)
    (execution,) = FakeExecution.made
    execution.obeys = False
    loop = asyncio.get_running_loop()
    running.cancel()
    while not execution.asked:
        await asyncio.sleep(0)
    assert execution.asked == ["stop"]
    begun = loop.time()
    while execution.asked == ["stop"] and loop.time() < begun + 30:
        running.cancel()
        await asyncio.sleep(0)
    assert execution.asked[1] == "force_stop"
    with pytest.raises(asyncio.CancelledError):
        await running


async def test_after_a_failure_nothing_is_started_any_more() -> None:
    """Neither what was to come, nor what would have been started again."""
    specs = [
        ProcessSpec(label=f"{name}-1", name=name, command=(name,), shown=name, respawn=True) for name in "ab"
    ]
    steps = [Start(process=specs[0]), Start(process=specs[1], after_sec=0.01)]

    def fail(event: Event) -> None:
        if isinstance(event, ProcessIO):
            raise OSError("a bug")

    runner = of(fail)
    running = asyncio.create_task(runner.run(steps))
    await asyncio.sleep(0)
    (execution,) = FakeExecution.made
    execution.obeys = False
    execution.writes(b"x")
    late = asyncio.get_running_loop().create_future()
    asyncio.get_running_loop().call_later(0.05, late.set_result, None)
    await late
    execution.ends(1)
    with pytest.raises(OSError, match="a bug"):
        await running
    assert FakeExecution.made == [execution]


async def test_what_happens_after_its_end_starts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard takes a moment to go, and the graph may change in it."""
    handler = AddHandler(
        what="x", matches=lambda event: isinstance(event, Appeared), steps=lambda _event: [late], presence=ADD
    )
    late = Start(process=ProcessSpec(label="late-2", name="late", command=("late",), shown="late"))
    first = Start(process=ProcessSpec(label="a-1", name="a", command=("a",), shown="a"))
    runner = of()

    async def close(guard: object) -> None:
        runner.graph({ADD})

    monkeypatch.setattr("actors.processes.driver.Guard.close", close)
    running = asyncio.create_task(runner.run([first, handler]))
    await asyncio.sleep(0)
    (execution,) = FakeExecution.made
    execution.ends()
    assert await running
    assert FakeExecution.made == [execution]


async def test_the_guard_goes_also_when_that_is_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    """A launch that is cancelled in its last moment leaves nothing behind."""
    gone: list[str] = []
    closing = asyncio.Event()

    async def close(guard: object) -> None:
        closing.set()
        await asyncio.sleep(0)
        gone.append("guard")

    monkeypatch.setattr("actors.processes.driver.Guard.close", close)
    running = asyncio.create_task(of().run(processes("a")))
    await asyncio.sleep(0)
    FakeExecution.made[0].ends()
    await closing.wait()
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    assert gone == ["guard"]


async def test_it_goes_on_until_all_have_ended_though_all_tasks_are_cancelled() -> None:
    """As whoever ends a loop does."""
    runner = of()
    running = asyncio.create_task(runner.run(processes("a")))
    await asyncio.sleep(0)
    (execution,) = FakeExecution.made
    execution.obeys = False
    for task in asyncio.all_tasks() - {asyncio.current_task()}:
        task.cancel()
    while not execution.asked:
        await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert not running.done()
    execution.ends()
    with pytest.raises(asyncio.CancelledError):
        await running


async def test_what_a_process_writes_moves_no_timer() -> None:
    """A flood of lines costs none: it is set when what is due next is another moment."""
    specs = [ProcessSpec(label=f"{name}-1", name=name, command=(name,), shown=name) for name in "ab"]
    runner = of()
    steps = [Start(process=specs[0]), Start(process=specs[1], after_sec=1000.0)]
    running = asyncio.create_task(runner.run(steps))
    await asyncio.sleep(0)
    (execution,) = FakeExecution.made
    timer = timer_of(runner)
    assert timer is not None
    execution.writes(b"x")
    assert timer_of(runner) is timer
    runner.stop("enough")
    assert timer.cancelled()
    assert await running


async def test_one_that_was_given_up_has_no_say_any_more() -> None:
    """Its last words may come after its end, and it may end again; nothing of it is reported."""
    told: list[Event] = []
    running = asyncio.create_task(of(told.append).run(processes("ab")))
    await asyncio.sleep(0)
    first, second = FakeExecution.made
    first.ends(1)
    before = len(told)
    first.writes(b"still here")
    first.ends()
    assert len(told) == before
    second.ends()
    await running


async def test_a_restart_stops_one_and_starts_it_again() -> None:
    """The new one is another execution, and is stopped with the launch."""
    runner = of()
    running = asyncio.create_task(runner.run(processes("a")))
    await asyncio.sleep(0)
    runner.restart("a-1", "changed")
    while len(FakeExecution.made) < 2:
        await asyncio.sleep(0)
    runner.stop("enough")
    assert await running
    assert [each.asked for each in FakeExecution.made] == [["stop"], ["stop"]]
