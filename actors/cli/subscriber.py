"""The subscriptions of a command, with a time limit and reports of lost messages."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import TIMEOUT, CommandError
from actors.cli.named import print_unpublished
from actors.cli.output import print_err
from actors.endpoints.events import SubscriptionEventCallbacks
from actors.errors import BrokerUnreachable
from actors.interfaces.errors import InvalidMessageError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine
    from typing import Self

    from actors.endpoints.events import LivelinessChangedInfo
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.endpoints.subscription.subscription import Subscription
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.node.node import Node
    from actors.qos.profile import QoSProfile

REPORT_EVERY_SEC: Final = 1.0
"""The shortest time between reports: a terminal that is too slow for the messages must not get more lines."""

SLOW_SEC: Final = 0.02
"""Other tasks run after each message whose output takes longer, so that the link stays alive."""


class _Losses:
    """The losses of a subscription, and those reported so far."""

    def __init__(self, subscription: Subscription[Any], clock: Callable[[], float]) -> None:
        self.subscription = subscription
        self._clock = clock
        self._expired_before: int | None = None
        self._reported = 0
        self._reported_at = -math.inf

    def count_expired(self) -> None:
        """Count messages that expire from now on: the command is too slow for them."""
        self._expired_before = self.subscription.expired

    def report(self, rest_sec: float) -> None:
        """Print the losses since the last report, unless that was less than `rest_sec` ago."""
        missed = self.subscription
        total = missed.dropped + missed.lost + missed.lost_on_break
        if self._expired_before is not None:
            total += missed.expired - self._expired_before
        if total == self._reported or self._clock() - self._reported_at < rest_sec:
            return
        print_err(
            f"{total - self._reported} message(s) of {missed.topic_name} lost: too fast, or lost on the way; "
            f"{total} in all"
        )
        self._reported, self._reported_at = total, self._clock()


class Listener:
    """The subscriptions of a command. On exit it reports losses and skipped messages on stderr.

    Args:
        node: The command's node.
        timeout_sec: Longest time without a message; None for no limit.
        report_losses: Report lost messages on stderr.
    """

    def __init__(self, node: Node, *, timeout_sec: float | None = None, report_losses: bool = True) -> None:
        self._node = node
        self._timeout_sec = math.inf if timeout_sec is None else timeout_sec
        self._report_losses = report_losses
        self._loop = asyncio.get_running_loop()
        self._done: asyncio.Future[None] = self._loop.create_future()
        self._received_at = self._loop.time()
        self._subscriptions: list[_Losses] = []
        self._rejected: Counter[str] = Counter()
        """Invalid messages of each topic."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """Report the losses that have not been reported."""
        self._report(0.0)
        for topic, number in self._rejected.items():
            if number > 1:
                print_err(f"{number} messages of {topic} left out in all")

    def subscribe(
        self,
        topic: str,
        take: Callable[[Any, MessageInfo], object],
        qos: QoSProfile,
        *,
        msg_type: type[Message] | None = None,
        raw: bool = False,
    ) -> None:
        """Subscribe to a topic.

        Args:
            topic: Its full name.
            take: Called with each message. If it raises InvalidMessageError, the message is skipped; any
                other exception ends the wait.
            qos: The profile.
            msg_type: The class to decode into; None for bytes.
            raw: Receive bytes although there is a type.
        """

        def receive(message: Any, info: MessageInfo) -> Coroutine[Any, Any, None] | None:
            if self._done.done():  # messages of the same batch, behind the last one that was wanted
                return None
            self._received_at = self._loop.time()
            try:
                take(message, info)
            except InvalidMessageError as error:
                if not self._rejected[topic]:
                    print_err(f"A message of {topic} is left out: {error}")
                self._rejected[topic] += 1
            except Exception as error:  # noqa: BLE001 - raised again where the command waits
                self._done.set_exception(error)
            slow = self._loop.time() - self._received_at > SLOW_SEC
            return asyncio.sleep(0) if slow else None

        events = SubscriptionEventCallbacks(message_lost=lambda _: self._report(REPORT_EVERY_SEC))
        typed = None if raw else msg_type  # bytes of another type can be printed, too
        subscription = self._node.create_subscription(
            typed, topic, receive, qos, raw=typed is None, event_callbacks=events
        )
        self._subscriptions.append(_Losses(subscription, self._loop.time))

    def _report(self, rest_sec: float) -> None:
        for losses in self._subscriptions if self._report_losses else []:
            losses.report(rest_sec)

    def report_losses(self) -> None:
        """Report losses, messages that have expired included, unless there was a report just now."""
        self._report(REPORT_EVERY_SEC)

    async def receive_latched(self, topic: str) -> None:
        """Wait until the latched messages of all publishers that a topic has now have been taken.

        Messages that expire until then are no losses: they were too old when the command started.

        Args:
            topic: The full name of a topic that the command has subscribed to.

        Raises:
            BrokerUnreachable: The link broke meanwhile.
            CommandError: The broker has refused the subscription.
        """
        await self._check_declared(topic)
        changed = asyncio.Event()
        attached = 0

        def note(info: LivelinessChangedInfo) -> None:
            nonlocal attached
            attached = info.alive_count + info.not_alive_count
            changed.set()

        # A publisher's frames stay in order: when it is attached to a later subscription, too, everything
        # that was latched for the first one has arrived.
        events = SubscriptionEventCallbacks(liveliness=note, matched=lambda _: changed.set())
        later = self._node.create_subscription(None, topic, None, 1, raw=True, event_callbacks=events)
        try:
            await self._check_declared(topic)
            while attached < later.get_publisher_count():
                changed.clear()
                await changed.wait()
        finally:
            later.destroy()
        if not self._node.connected:
            raise BrokerUnreachable("The link to the broker broke")
        while any(each.subscription.queued for each in self._subscriptions):  # noqa: ASYNC110 - no such event
            await asyncio.sleep(0)  # the mailbox hands them over
        for losses in self._subscriptions:
            losses.count_expired()

    async def _check_declared(self, topic: str) -> None:
        """Wait until the broker has declared and matched all subscriptions.

        Raises:
            BrokerUnreachable: The link broke meanwhile.
            CommandError: The broker has refused the subscription to a topic.
        """
        snapshot = await self._node.get_graph()
        own = self._node.get_fully_qualified_name()
        if all(each.node != own for each in snapshot.of_kind(EntryKind.SUBSCRIPTION) if each.name == topic):
            raise CommandError(f"The broker has refused the subscription to {topic}")

    def enough(self) -> None:
        """End the wait, and handle no more messages."""
        if not self._done.done():
            self._done.set_result(None)

    async def wait(self) -> None:
        """Wait for `enough`.

        Raises:
            CommandError: No message arrived within the limit.
        """
        async for _ in self.ticks(math.inf):
            pass

    async def ticks(self, period_sec: float) -> AsyncIterator[None]:
        """Yield once in a period, without drift, until `enough`.

        Raises:
            CommandError: No message arrived within the limit.
        """
        # From the same moment as the limit: how late the machine wakes this up does not change which of them
        # comes first.
        due = self._received_at + period_sec
        while True:
            wake = min(due, self._received_at + self._timeout_sec)
            left = None if wake == math.inf else max(0.0, wake - self._loop.time())
            await asyncio.wait({self._done}, timeout=left)
            if self._done.done():
                self._done.result()
                return
            now, end = self._loop.time(), self._received_at + self._timeout_sec
            if due <= min(now, end):
                due = max(due + period_sec, now)
                yield
            elif end <= now:
                names = ", ".join(each.subscription.topic_name for each in self._subscriptions)
                raise CommandError(f"No message on {names} within {self._timeout_sec:g} s", TIMEOUT)


def warn_unpublished(snapshot: GraphSnapshot, topic: str) -> None:
    """Warn on stderr if a topic has no publisher, with a suggestion."""
    if not snapshot.count(EntryKind.PUBLISHER, topic):
        known = dict(snapshot.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
        print_unpublished(topic, known)
