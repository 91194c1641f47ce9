"""A launch as programs have it: an object, run in a task of theirs."""

from __future__ import annotations

import asyncio
import os
import threading
from typing import TYPE_CHECKING

import pytest

from actors.launch import (
    Command,
    ExecuteProcess,
    FileContent,
    Launch,
    LaunchDescription,
    LaunchError,
    LogInfo,
    Node,
    OnProcessStart,
    OnShutdown,
    OpaqueFunction,
    RegisterEventHandler,
    TimerAction,
    launching,
)
from actors.launch.description.conditions import Condition
from actors.launch.description.substitutions import LaunchContext, Substitution
from actors.launch.launching import FIND_TRIES
from actors.launch.planning.events import Message, ProcessExited, ProcessStarted
from actors.processes.local_broker import broker_is_there
from broker import AddressInUseError
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from pathlib import Path

    from actors.config.contexts import BrokerTarget
    from actors.launch.description.action import Action
    from actors.launch.planning.events import Event
    from tests.actors.meeting import Meeting

SLEEPER = ExecuteProcess(cmd=["sleep", "1000"], name="sleeper")
"""SIGINT ends it with that signal from its first moment on; Python may exit with 1 while it starts."""


async def test_a_launch_can_be_stopped_before_it_runs(meeting: Meeting) -> None:
    """Then it starts nothing, and nothing has gone wrong."""
    received: list[Event] = []
    launch = Launch(LaunchDescription([SLEEPER]), url=meeting.url, listeners=[received.append])
    launch.stop("not wanted")
    assert await launch.run()
    assert received == []


async def test_two_launches_run_in_one_loop(meeting: Meeting) -> None:
    """One is stopped by what the other says; each has its own processes, and both end well."""

    def started(event: Event) -> None:
        if isinstance(event, ProcessStarted):
            other.stop("one is up")
            one.stop("enough")

    ended: list[str] = []

    def received(event: Event) -> None:
        if isinstance(event, ProcessExited):
            ended.append(event.process_name)

    description = LaunchDescription([SLEEPER])
    one = Launch(description, url=meeting.url, listeners=[started, received])
    other = Launch(description, url=meeting.url, listeners=[received])
    assert all(await asyncio.gather(one.run(), other.run()))
    assert set(ended) <= {"sleeper-1"}
    assert "sleeper-1" in ended


def test_what_is_asked_to_stop_gets_five_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in ROS 2, if nobody says otherwise; then it is asked again, more firmly."""

    async def look(target: BrokerTarget) -> bool:
        return bool(target.urls) and not target.domain

    monkeypatch.setattr(launching, "broker_is_there", look)

    async def scene(stage: Stage) -> None:
        asked: list[float] = []

        async def deaf() -> None:
            for _ in range(2):
                try:
                    await asyncio.sleep(1000)
                except asyncio.CancelledError:
                    asked.append(stage.loop.time())

        def received(event: Event) -> None:
            if isinstance(event, ProcessStarted):
                stage.loop.call_later(1, launch.stop, "enough")

        launch = Launch(LaunchDescription([Node(node=deaf)]), listeners=[received])
        launch.plan()  # no thread in a simulation
        await launch.run()
        first, second = asked
        assert second - first == pytest.approx(5.0)

    play(scene)


class Fails(Substitution):
    """A substitution of a user that raises what it was made with."""

    def __init__(self, error: BaseException) -> None:
        self._error = error

    def perform(self, scope: LaunchContext) -> str:
        """Raise it."""
        raise self._error


class FailsCondition(Condition):
    """A condition of a user that raises what it was made with."""

    def __init__(self, error: BaseException) -> None:
        self._error = error

    def evaluate(self, scope: LaunchContext) -> bool:
        """Raise it."""
        raise self._error


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (SystemExit(4), "SystemExit: 4"),
        (GeneratorExit(), "GeneratorExit"),
        (asyncio.CancelledError(), "CancelledError"),
        (pytest.fail.Exception("no map"), "Failed: no map"),
    ],
)
@pytest.mark.parametrize("part", ["substitution", "condition"])
async def test_what_a_substitution_raises_in_an_event_handler_ends_the_launch(
    meeting: Meeting, error: BaseException, text: str, part: str
) -> None:
    """Also if it is no Exception: one error line says what and where, processes stop, and it has failed."""
    bad = (
        LogInfo(msg=Fails(error))
        if part == "substitution"
        else LogInfo(msg="x", condition=FailsCondition(error))
    )
    heard: list[Event] = []
    description = LaunchDescription(
        [SLEEPER, RegisterEventHandler(OnProcessStart(on_start=lambda event: [bad]))]
    )
    launch = Launch(description, url=meeting.url, listeners=[heard.append])
    async with asyncio.timeout(30):
        assert not await launch.run()
    assert text in launch.error
    assert "LogInfo" in launch.error
    assert [each for each in heard if isinstance(each, Message) and text in each.text]
    assert any(isinstance(each, ProcessExited) for each in heard)


async def test_a_stop_iteration_in_an_event_handler_ends_the_launch(meeting: Meeting) -> None:
    """A future cannot hold it, so it is raised as another error."""
    bad = LogInfo(msg="x", condition=FailsCondition(StopIteration()))
    description = LaunchDescription(
        [SLEEPER, RegisterEventHandler(OnProcessStart(on_start=lambda event: [bad]))]
    )
    with pytest.raises(RuntimeError, match="StopIteration"):
        async with asyncio.timeout(30):
            await Launch(description, url=meeting.url).run()


@pytest.mark.parametrize("late", [1, 3])
async def test_another_launch_may_be_quicker_to_bring_a_broker(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, late: int
) -> None:
    """Where nothing answered, and then the place is in use, it looks again: the other's may take a moment."""
    looks = _blind_at_first(monkeypatch, late)
    received: list[Event] = []
    launch = Launch(LaunchDescription([]), url=meeting.url, listeners=[received.append])
    assert await launch.run()
    assert len(looks) == late + 1
    assert not any("starts one of its own" in str(event) for event in received)


async def test_a_place_in_use_where_no_broker_is_there_is_given_up(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After some looks the launch ends with the reason."""
    looks = _blind_at_first(monkeypatch, FIND_TRIES)
    with pytest.raises(AddressInUseError):
        await Launch(LaunchDescription([]), url=meeting.url).run()
    assert len(looks) == FIND_TRIES


def _blind_at_first(monkeypatch: pytest.MonkeyPatch, times: int) -> list[str]:
    """Let the first looks find no broker; return where has been looked."""
    looks: list[str] = []

    async def look(target: BrokerTarget) -> bool:
        looks.append(target.url)
        return len(looks) > times and await broker_is_there(target)

    monkeypatch.setattr(launching, "broker_is_there", look)
    monkeypatch.setattr(launching, "FIND_PAUSE_SEC", 0.0)
    return looks


class Gate:
    """Something that only a loop that is not blocked can open.

    Attributes:
        passed: In which threads it has been passed.
    """

    def __init__(self) -> None:
        self.passed: list[threading.Thread] = []
        self._reached = asyncio.Event()
        self._open = threading.Event()
        self._loop = asyncio.get_running_loop()

    def wait(self, *_: object) -> None:
        """Be a function of a description: wait until the loop has opened the gate."""
        self._loop.call_soon_threadsafe(self._reached.set)
        assert self._open.wait(10)
        self.passed.append(threading.current_thread())

    async def open(self) -> None:
        """Open it when somebody waits there."""
        await self._reached.wait()
        self._open.set()


@pytest.mark.parametrize("when", ["planned", "timer", "handler"])
async def test_functions_of_a_description_do_not_block_the_loop(meeting: Meeting, when: str) -> None:
    """Whether they are called for the plan, in a timer, or when something happens."""
    gate = Gate()
    function = OpaqueFunction(function=gate.wait)
    actions: dict[str, Action] = {
        "planned": function,
        "timer": TimerAction(period=0.01, actions=[function]),
        "handler": RegisterEventHandler(OnShutdown(on_shutdown=gate.wait)),
    }
    launch = Launch(LaunchDescription([actions[when]]), url=meeting.url)
    good, _ = await asyncio.gather(launch.run(), gate.open())
    assert good
    assert gate.passed != [threading.main_thread()]


async def test_what_is_wrong_with_a_description_is_raised_before_anything_runs(meeting: Meeting) -> None:
    """By whatever plans it."""
    received: list[Event] = []
    description = LaunchDescription([SLEEPER, LogInfo(msg=FileContent("/no/such/file"))])
    launch = Launch(description, url=meeting.url, listeners=[received.append])
    with pytest.raises(LaunchError, match="No file '/no/such/file'"):
        await launch.run()
    with pytest.raises(LaunchError, match="No file '/no/such/file'"):
        launch.plan()
    assert received == []


@pytest.mark.parametrize("cancel", [True, False])
async def test_a_launch_that_is_stopped_while_it_is_planned_leaves_no_command(
    meeting: Meeting, tmp_path: Path, *, cancel: bool
) -> None:
    """The command is killed, and nothing is started."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    script = tmp_path / "lasting.sh"
    script.write_text(f"exec >'{path}'; echo runs; sleep 1000")
    launch = Launch(LaunchDescription([LogInfo(msg=Command(["sh ", script])), SLEEPER]), url=meeting.url)
    running = asyncio.create_task(launch.run())
    with await asyncio.to_thread(path.open) as pipe:
        assert await asyncio.to_thread(pipe.readline) == "runs\n"
        if cancel:
            running.cancel()
            with pytest.raises(asyncio.CancelledError):
                await running
        else:
            launch.stop("not wanted")
            assert await running
        assert await asyncio.to_thread(pipe.read) == ""
