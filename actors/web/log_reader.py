"""The log of all nodes for browsers: for each reader a subscription to `/rosout`, with the kept lines."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec

from actors.interfaces.rcl_interfaces.msg import Log
from actors.logging.logger import node_logger_name
from actors.logging.severity import severity_from_name
from actors.qos.profile import DurabilityPolicy, QoSProfile
from actors.tools.node_documents import log_line
from actors.web import limits
from actors.web.subscription_answer import SubscriptionAnswer
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.web.observer import Observer

TOPIC: Final = "/rosout"

DEPTH: Final = 10_000
"""Lines that wait for this process at most: those that are kept of ten nodes that log a lot."""

MAX_READERS: Final = 2 * limits.MAX_HOLDER_STREAMS
"""Readers of the log at the same time: one user's, or one address's, streams leave as many to others."""

MAX_WAITING: Final = 2000
"""Lines that wait for a reader: what a page shows. The newest by their time are kept."""

MAX_WAITING_CHARACTERS: Final = 4 * 1024 * 1024
"""The same for the characters of their messages."""

LINES_PER_UPDATE: Final = 200
"""Lines of one update."""


class TooManyLogReadersError(CallboardError):
    """So many read the log already. Close one."""


class LogFilter(msgspec.Struct, forbid_unknown_fields=True):
    """Which lines are wanted.

    Attributes:
        level: The least severity.
        node: A node's full name (its child loggers included) or a namespace, or, without a slash at its
            beginning, a part of the node's or logger's name; empty for all.
        text: A part of the message, in any case; empty for all.
    """

    level: Literal["debug", "info", "warn", "error", "fatal"] = "debug"
    node: str = ""
    text: str = ""

    def matcher(self) -> Callable[[Log, str], bool]:
        """Return a function that says whether a line is wanted, given the node that published it."""
        least = 0 if self.level == "debug" else int(severity_from_name(self.level))
        full = self.node.startswith("/")
        prefix = f"{node_logger_name(self.node.rstrip('/'))}." if full and self.node != "/" else ""
        part = "" if full else self.node.casefold()
        text = self.text.casefold()

        def matches(line: Log, node: str) -> bool:
            return (
                line.level >= least
                and (not prefix or f"{line.name}.".startswith(prefix))
                and (not part or part in line.name.casefold() or part in node.casefold())
                and (not text or text in line.msg.casefold())
            )

        return matches


class LogReader:
    """The lines that one reader wants: those that are kept, then new ones.

    Args:
        observer: Has the node.
        chosen: Which lines.
        wake: Called when there is something to take.
        ended: Called once when it is closed.

    Attributes:
        skipped: Lines that made room, or were lost on their way, since it was last set to 0.
    """

    def __init__(
        self, observer: Observer, chosen: LogFilter, wake: Callable[[], None], ended: Callable[[], None]
    ) -> None:
        self._observer = observer
        self._matches = chosen.matcher()
        self._wake = wake
        self._ended = ended
        self._waiting: list[tuple[int, int, Log, str]] = []
        """A heap, the oldest first; the second item is the order of arrival."""
        self._characters = 0
        self._received = 0
        self._lost = 0
        self.skipped = 0
        profile = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._subscription = observer.node.create_subscription(Log, TOPIC, self._receive, profile)
        self._answer = SubscriptionAnswer(observer.node, lambda: self._subscription, wake)

    def pop(self) -> list[dict[str, Any]]:
        """Return the oldest lines that wait, `LINES_PER_UPDATE` at most, in the order of their time.

        Raises:
            SubscriptionRefusedError: The broker refuses the subscription.
        """
        self._answer.require_accepted()
        taken = [heapq.heappop(self._waiting) for _ in range(min(LINES_PER_UPDATE, len(self._waiting)))]
        self._characters -= sum(len(line.msg) for _, _, line, _ in taken)
        if self._waiting:
            self._wake()
        return [log_line(line, node) for _, _, line, node in taken]

    async def accepted(self) -> None:
        """Wait until the broker has answered the subscription, or cannot be reached.

        Raises:
            SubscriptionRefusedError: It refuses it.
        """
        await self._answer.accepted()

    def close(self) -> None:
        """Read no more."""
        self._answer.close()
        if self._observer.node.destroy_subscription(self._subscription):
            self._ended()

    def _receive(self, line: Log, info: MessageInfo) -> None:
        subscription = self._subscription
        lost = subscription.dropped + subscription.lost
        missed, self._lost = lost - self._lost, lost
        self.skipped += missed
        if not self._matches(line, info.publisher_node):
            return
        if not self._waiting:
            self._wake()
        self._received += 1
        stamp_ns = line.stamp.sec * 1_000_000_000 + line.stamp.nanosec
        heapq.heappush(self._waiting, (stamp_ns, self._received, line, info.publisher_node))
        self._characters += len(line.msg)
        while len(self._waiting) > MAX_WAITING or self._characters > MAX_WAITING_CHARACTERS:
            _, _, oldest, _ = heapq.heappop(self._waiting)
            self._characters -= len(oldest.msg)
            self.skipped += 1


class LogReaders:
    """Those who read the log.

    Args:
        observer: Has the node.
    """

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._count = 0

    def read(self, chosen: LogFilter, wake: Callable[[], None]) -> LogReader:
        """Begin to read.

        Args:
            chosen: Which lines.
            wake: Called when there is something to take.

        Raises:
            TooManyLogReadersError: There are `MAX_READERS`.
        """
        if self._count >= MAX_READERS:
            raise TooManyLogReadersError(f"{MAX_READERS} read the log already; close one")
        reader = LogReader(self._observer, chosen, wake, self._end)
        self._count += 1
        return reader

    def _end(self) -> None:
        self._count -= 1
