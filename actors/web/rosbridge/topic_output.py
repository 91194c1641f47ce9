"""What a client gets of one topic, and when. Pure: no clock.

A client may subscribe several times, with ids: it gets each message once, in the way that suits all of them.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, Generic, NamedTuple, TypeVar

if TYPE_CHECKING:
    from actors.web.rosbridge.operations import Compression, Id, Subscribe

T = TypeVar("T")

MAX_WAITING: Final = 1000
"""Messages that wait for a slow client at most."""

MAX_QUEUE: Final = 100
"""Messages that wait for a throttle at most."""

MAX_SUBSCRIPTIONS: Final = 100
"""Subscriptions of one client to one topic."""

_PRECEDENCE: Final[tuple[Compression, ...]] = ("cbor-raw", "cbor", "png")


class _Wishes(NamedTuple):
    """Those of one subscription."""

    throttle_sec: float
    queue_length: int
    fragment_size: int | None
    compression: Compression


class TopicOutput(Generic[T]):
    """A topic for one client.

    Attributes:
        throttle_sec: The least time between two messages: the shortest that a subscription asks for.
        queue_length: Messages that wait for it: the most that a subscription asks for.
        fragment_size: Characters of the largest frame: the fewest; None for no limit.
        compression: How messages are sent: as one subscription asks for; of several, the densest.
    """

    def __init__(self) -> None:
        self._wishes: dict[Id, _Wishes] = {}
        self._waiting: deque[T] = deque()
        self._next_sec = 0.0
        self._decide()

    def __bool__(self) -> bool:
        """Return whether there is a subscription."""
        return bool(self._wishes)

    @property
    def is_full(self) -> bool:
        """Whether there are as many subscriptions as a client may have."""
        return len(self._wishes) >= MAX_SUBSCRIPTIONS

    def subscribe(self, request: Subscribe) -> None:
        """Add a subscription, or replace that of the same id."""
        self._wishes[request.id] = _Wishes(
            (request.throttle_rate or 0) / 1000,
            request.queue_length or 0,
            request.fragment_size,
            request.compression or "none",
        )
        self._decide()

    def unsubscribe(self, id_: Id) -> bool:
        """End a subscription.

        Args:
            id_: Which; None for all.

        Returns:
            Whether there was any.
        """
        if id_ is None:
            found = bool(self._wishes)
            self._wishes.clear()
        else:
            found = self._wishes.pop(id_, None) is not None
        self._decide()
        return found

    @property
    def limit(self) -> int:
        """How many messages may wait for a slow client."""
        return MAX_WAITING if self.throttle_sec else min(self.queue_length or MAX_WAITING, MAX_WAITING)

    @property
    def waiting(self) -> int:
        """How many messages wait for the throttle."""
        return len(self._waiting)

    @property
    def next_sec(self) -> float:
        """When the next message may be sent."""
        return self._next_sec

    def add(self, message: T) -> None:
        """Let a message wait for the throttle; the oldest make room, which the client has asked for."""
        self._waiting.append(message)
        # Without a length the newest waits for its time, so that a slow topic shows no old message.
        while len(self._waiting) > max(1, min(self.queue_length, MAX_QUEUE)):
            self._waiting.popleft()

    def pop(self, now_sec: float) -> T | None:
        """Return the message to send now; None if none waits, or its time has not come.

        Args:
            now_sec: The time, by any clock that never goes back.
        """
        if not self._waiting or now_sec < self._next_sec:
            return None
        self._next_sec = now_sec + self.throttle_sec
        return self._waiting.popleft()

    def _decide(self) -> None:
        wishes = self._wishes.values()
        self.throttle_sec = min((each.throttle_sec for each in wishes), default=0.0)
        self.queue_length = max((each.queue_length for each in wishes), default=0)
        sizes = [each.fragment_size for each in wishes if each.fragment_size is not None]
        self.fragment_size = min(sizes, default=None)
        asked = {each.compression for each in wishes}
        chosen: list[Compression] = [each for each in _PRECEDENCE if each in asked]
        self.compression: Compression = chosen[0] if chosen else "none"
