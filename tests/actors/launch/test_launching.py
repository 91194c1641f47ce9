"""A launch as programs have it: an object, run in a task of theirs."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING

import pytest

from actors.launch import ExecuteProcess, Launch, LaunchDescription, Node, launching
from actors.launch.embedded import broker_is_there
from actors.launch.events import ProcessExited, ProcessStarted
from actors.launch.launching import FIND_TRIES
from broker import AddressInUseError
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from actors.launch.events import Event
    from tests.actors.meeting import Meeting

SLEEPER = ExecuteProcess(cmd=[sys.executable, "-c", "import time; time.sleep(1000)"], name="sleeper")


async def test_a_launch_can_be_stopped_before_it_runs(meeting: Meeting) -> None:
    """Then it starts nothing, and nothing has gone wrong."""
    heard: list[Event] = []
    launch = Launch(LaunchDescription([SLEEPER]), url=meeting.url, listeners=[heard.append])
    launch.stop("not wanted")
    assert await launch.run()
    assert heard == []


async def test_two_launches_run_in_one_loop(meeting: Meeting) -> None:
    """One is stopped by what the other says; each has its own processes, and both end well."""

    def started(event: Event) -> None:
        if isinstance(event, ProcessStarted):
            other.stop("one is up")
            one.stop("enough")

    ended: list[str] = []

    def heard(event: Event) -> None:
        if isinstance(event, ProcessExited):
            ended.append(event.process_name)

    description = LaunchDescription([SLEEPER])
    one = Launch(description, url=meeting.url, listeners=[started, heard])
    other = Launch(description, url=meeting.url, listeners=[heard])
    assert all(await asyncio.gather(one.run(), other.run()))
    assert set(ended) <= {"sleeper-1"}
    assert "sleeper-1" in ended


def test_what_is_asked_to_stop_gets_five_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in ROS 2, if nobody says otherwise; then it is asked again, more firmly."""

    async def look(urls: str, domain: int) -> bool:
        return bool(urls) and not domain

    monkeypatch.setattr(launching, "broker_is_there", look)

    async def scene(stage: Stage) -> None:
        asked: list[float] = []

        async def deaf() -> None:
            for _ in range(2):
                try:
                    await asyncio.sleep(1000)
                except asyncio.CancelledError:
                    asked.append(stage.loop.time())

        def heard(event: Event) -> None:
            if isinstance(event, ProcessStarted):
                stage.loop.call_later(1, launch.stop, "enough")

        launch = Launch(LaunchDescription([Node(node=deaf)]), listeners=[heard])
        await launch.run()
        first, second = asked
        assert second - first == pytest.approx(5.0)

    play(scene)


@pytest.mark.parametrize("late", [1, 3])
async def test_another_launch_may_be_quicker_to_bring_a_broker(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, late: int
) -> None:
    """Where nothing answered, and then the place is in use, it looks again: the other's may take a moment."""
    looks = _blind_at_first(monkeypatch, late)
    heard: list[Event] = []
    launch = Launch(LaunchDescription([]), url=meeting.url, listeners=[heard.append])
    assert await launch.run()
    assert len(looks) == late + 1
    assert not any("brings its own" in str(event) for event in heard)


async def test_a_place_in_use_where_no_broker_answers_is_given_up(
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

    async def look(urls: str, domain: int) -> bool:
        looks.append(urls)
        return len(looks) > times and await broker_is_there(urls, domain)

    monkeypatch.setattr(launching, "broker_is_there", look)
    monkeypatch.setattr(launching, "FIND_PAUSE_SEC", 0.0)
    return looks
