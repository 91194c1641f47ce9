"""A part of a ring of nodes: each publishes to the next one, calls it, and has a call in flight there.

On the command "go" it publishes and calls, and writes "going" when every node has received a message and a
reply. On "brace" it writes "back" when that is true again after the connection has broken. On "stop" it
publishes its last messages, waits for those of the others, and writes "totals".
"""

from __future__ import annotations

import asyncio
import math
import os
import time
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from benchmarks.faults.roles.attempts import taken_attempts
from benchmarks.faults.roles.controller import CLOSED, Controller, report
from benchmarks.harness import meters

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

ASK_PERIOD_S: Final = 0.1
"""Between a node's short calls."""
HUNG_S: Final = 20.0
"""A short call that takes longer counts as hung."""
FOR_EVER: Final = -1
"""As `a` of a request: never answer."""


class Member(actors.Node):
    """Node `number` of the `total` nodes of the ring.

    Attributes:
        failed_at: When its call in flight failed since the last `brace` (monotonic, s), or None.
        received_at: When the first message arrived after that.
        answered_at: When the first short call returned after that.
    """

    def __init__(self, number: int, total: int, *, url: str, changed: Callable[[], None]) -> None:
        super().__init__(f"ring_{number}", url=url)
        after, before = (number + 1) % total, (number - 1) % total
        self._changed = changed
        self._publisher = self.create_publisher(Int64, f"ring_{number}", 10)
        self._subscription = self.create_subscription(Int64, f"ring_{before}", self._on_number, 10)
        self.create_service(AddTwoInts, f"ring_{number}", self._add, concurrent=True)
        self._client = self.create_client(AddTwoInts, f"ring_{after}")
        self._last = -1
        self.duplicates = self.hung = 0
        self.expected: int | None = None
        """Messages published by the previous node; its last message says how many."""
        self.brace()

    def brace(self) -> None:
        """Reset the times of the last break."""
        self.failed_at: float | None = None
        self.received_at: float | None = None
        self.answered_at: float | None = None

    @property
    def going(self) -> bool:
        """Whether it has received a message and a reply."""
        return self.received_at is not None and self.answered_at is not None

    def _on_number(self, msg: Int64) -> None:
        number = abs(msg.data)
        self.duplicates += number <= self._last
        self._last = number
        if msg.data < 0:
            self.expected = -msg.data
            self._changed()
        if self.received_at is None:
            self.received_at = time.monotonic()
            self._changed()

    async def _add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == FOR_EVER:
            await asyncio.Event().wait()
        return AddTwoInts.Response(sum=request.a + request.b)

    def publish_at(self, rate: float) -> actors.Timer:
        """Publish `rate` messages a second from now on."""
        return self.create_timer(1 / rate, self._publish)

    def _publish(self) -> None:
        self._publisher.publish(Int64(data=self._publisher.published + 1))

    def publish_last(self) -> None:
        """Publish the last number, negated."""
        self._publisher.publish(Int64(data=-(self._publisher.published + 1)))

    async def hold(self) -> None:
        """Keep a call in flight that is never answered."""
        while True:
            await self._client.wait_for_service()
            try:
                await self._client.call(AddTwoInts.Request(a=FOR_EVER), timeout_sec=math.inf)
            except actors.ServiceUnavailable:
                if self.failed_at is None:
                    self.failed_at = time.monotonic()
                    self.received_at = self.answered_at = None

    async def ask(self) -> None:
        """Call repeatedly while there is a server."""
        while True:
            await self._client.wait_for_service()
            try:
                await self._client.call(AddTwoInts.Request(a=1, b=2), timeout_sec=HUNG_S)
            except actors.ServiceUnavailable:
                continue
            except actors.ServiceTimeout:
                self.hung += 1
            if self.answered_at is None:
                self.answered_at = time.monotonic()
                self._changed()
            await asyncio.sleep(ASK_PERIOD_S)

    def totals(self) -> dict[str, int]:
        """Return the previous node's messages by outcome, and the messages that this node dropped unsent."""
        subscription = self._subscription
        found = subscription.received + subscription.dropped + subscription.lost + subscription.lost_on_break
        return {
            "published": self.expected or 0,
            "received": subscription.received,
            "dropped_by_reader": subscription.dropped,
            "lost": subscription.lost,
            "lost_on_break": subscription.lost_on_break,
            "dropped_by_publisher": self._publisher.dropped,
            "unaccounted": (self.expected or 0) - found,
            "duplicates": self.duplicates,
            "hung": self.hung,
        }


class Part:
    """The members of the ring in this process."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self._changed = asyncio.Event()
        total, url = parameters["total"], parameters["url"]
        self.members = [Member(i, total, url=url, changed=self._changed.set) for i in parameters["numbers"]]

    async def until(self, condition: Callable[[Member], bool]) -> None:
        """Wait until a condition holds for all members."""
        while not all(map(condition, self.members)):
            self._changed.clear()
            await self._changed.wait()


async def run(parameters: Mapping[str, Any], controller: Controller) -> None:
    """Carry out commands until the ring stops."""
    part = Part(parameters)
    async with AsyncExitStack() as stack:
        for member in part.members:
            await stack.enter_async_context(member)
        await asyncio.gather(*(member.get_graph() for member in part.members))
        report("ready")
        group = await stack.enter_async_context(asyncio.TaskGroup())
        working: list[asyncio.Task[None]] = []
        timers: list[actors.Timer] = []
        while (command := await controller.next_command()) not in {CLOSED, "stop"}:
            if command == "go":
                timers = [member.publish_at(parameters["rate"]) for member in part.members]
                calls = [call for member in part.members for call in (member.hold(), member.ask())]
                working = [group.create_task(call) for call in calls]
                await part.until(lambda member: member.going)
                taken_attempts()
                report("going", **_resources())
            elif command == "brace":
                for member in part.members:
                    member.brace()
                report("braced")
                await part.until(lambda member: member.failed_at is not None and member.going)
                report("back", members=[_moments(member) for member in part.members], **_resources())
        for timer, member in zip(timers, part.members, strict=True):
            timer.cancel()
            member.publish_last()
        await part.until(lambda member: member.expected is not None)
        for task in working:
            task.cancel()
        report("totals", members=[member.totals() for member in part.members])


def _moments(member: Member) -> list[float]:
    assert member.failed_at is not None
    assert member.received_at is not None
    assert member.answered_at is not None
    return [member.failed_at, member.received_at, member.answered_at]


def _resources() -> dict[str, Any]:
    """Return tasks, open files, memory and the connection attempts."""
    return {
        "tasks": len(asyncio.all_tasks()),
        "files": meters.open_files(os.getpid()),
        "memory_kib": meters.memory_kib(os.getpid()),
        "attempts": taken_attempts(),
    }
