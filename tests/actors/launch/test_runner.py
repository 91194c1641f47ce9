"""The runner carries out what the machine decides: bodies here are made up, and end when they are told to."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch import runner as runner_module
from actors.launch.events import Event, ProcessIO, ProcessStarted, ShuttingDown, Stream
from actors.launch.machine import Machine
from actors.launch.runner import Runner
from actors.launch.steps import ProcessSpec, Start
from actors.supervision.outcome import outcome_of_exit

if TYPE_CHECKING:
    import contextvars
    from collections.abc import Callable


class FakeBody:
    """A process that is made up. `made` has all of them."""

    made: list[FakeBody]

    def __init__(self, spec: ProcessSpec, *args: Any, **told: Any) -> None:
        self.spec = spec
        self.told = told
        self.pid = 7
        self.asked: list[str] = []
        self.obeys = True
        FakeBody.made.append(self)

    def start(self, context: contextvars.Context) -> None:
        self.told["on_started"]()

    def stop(self) -> None:
        self.asked.append("stop")
        if self.obeys:
            asyncio.get_running_loop().call_soon(self.ends)

    def hurry(self) -> None:
        self.asked.append("hurry")
        asyncio.get_running_loop().call_soon(self.ends, -9)

    def ends(self, code: int = 0) -> None:
        self.told["on_ended"](outcome_of_exit(code))

    def writes(self, *lines: bytes) -> None:
        self.told["write"](Stream.OUTPUT, list(lines))


@pytest.fixture(autouse=True)
def _fake(monkeypatch: pytest.MonkeyPatch) -> None:
    FakeBody.made = []
    monkeypatch.setattr(runner_module, "LaunchedProcess", FakeBody)


def of(names: str, *listeners: Callable[[Event], None]) -> Runner:
    """Return a runner of processes with these names."""
    steps = [
        Start(process=ProcessSpec(label=f"{name}-1", name=name, command=(name,), shown=name))
        for name in names
    ]
    return Runner(Machine(steps), list(listeners), stop_timeout_sec=1)


async def test_it_ends_when_all_have_ended() -> None:
    """And what happened has been told in order."""
    told: list[str] = []
    running = asyncio.create_task(of("ab", lambda event: told.append(type(event).__name__)).run())
    await asyncio.sleep(0)
    first, second = FakeBody.made
    first.writes(b"x")
    first.ends()
    second.ends(1)
    assert await running
    assert told == [*["ProcessStarted"] * 2, "ProcessIO", *["ProcessExited"] * 2]


async def test_a_listener_may_stop_the_launch() -> None:
    """In the middle of starting: what has been started by then, and what is just being, is stopped."""

    def stop(event: Event) -> None:
        if isinstance(event, ProcessStarted):
            runner.stop("enough")

    told: list[Event] = []
    runner = of("ab", stop, told.append)
    assert await runner.run()
    assert [each.asked for each in FakeBody.made] == [["stop"], ["stop"]]
    assert told.count(ShuttingDown("enough")) == 1


async def test_a_listener_that_fails_fails_the_launch() -> None:
    """Nothing is left running, and the error is raised to whoever runs it."""

    def fail(event: Event) -> None:
        if isinstance(event, ProcessIO):
            raise OSError("a bug")

    running = asyncio.create_task(of("ab", fail).run())
    await asyncio.sleep(0)
    first, second = FakeBody.made
    first.writes(b"x")
    with pytest.raises(OSError, match="a bug"):
        await running
    assert (first.asked, second.asked) == (["stop"], ["stop"])


async def test_cancelling_it_stops_all_and_then_hurries() -> None:
    """It is cancelled only when everything has ended."""
    runner = of("a")
    running = asyncio.create_task(runner.run())
    await asyncio.sleep(0)
    (body,) = FakeBody.made
    body.obeys = False
    loop = asyncio.get_running_loop()
    running.cancel()
    while not body.asked:
        await asyncio.sleep(0)
    assert body.asked == ["stop"]
    begun = loop.time()
    while body.asked == ["stop"] and loop.time() < begun + 30:
        running.cancel()
        await asyncio.sleep(0)
    assert body.asked[1] == "hurry"
    with pytest.raises(asyncio.CancelledError):
        await running


async def test_one_that_was_given_up_has_no_say_any_more() -> None:
    """Its last words may come after its end, and it may end again; nobody is told."""
    told: list[Event] = []
    running = asyncio.create_task(of("ab", told.append).run())
    await asyncio.sleep(0)
    first, second = FakeBody.made
    first.ends(1)
    before = len(told)
    first.writes(b"still here")
    first.ends()
    assert len(told) == before
    second.ends()
    await running


async def test_a_restart_stops_one_and_starts_it_again() -> None:
    """The new one is another body, and is stopped with the launch."""
    runner = of("a")
    running = asyncio.create_task(runner.run())
    await asyncio.sleep(0)
    runner.restart("a-1", "changed")
    while len(FakeBody.made) < 2:
        await asyncio.sleep(0)
    runner.stop("enough")
    assert await running
    assert [each.asked for each in FakeBody.made] == [["stop"], ["stop"]]
