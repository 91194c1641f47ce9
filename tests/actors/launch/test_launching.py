"""A launch as programs have it: an object, run in a task of theirs."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING

from actors.launch import ExecuteProcess, Launch, LaunchDescription
from actors.launch.events import ProcessExited, ProcessStarted

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
