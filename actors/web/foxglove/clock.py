"""Simulated time of the graph, while anybody wants to know it."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import type_name
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.web.topic_feed import TooManyTopicsError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.observer import Observer
    from actors.web.topic_feed import Received, TopicFeeds, TopicListener

CLOCK_TOPIC: Final = "/clock"
TYPE: Final = type_name(ClockMessage)


class Clock:
    """Follows `/clock` as long as it has a publisher.

    Args:
        observer: Has the graph.
        feeds: Read topics.
        changed: Called when the clock has begun, ended, or moved.
        refused: Called when the user may not read it.

    Attributes:
        time_ns: The time; None while there is no simulated time: a publisher that has sent nothing yet, or
            whose messages the user may not read, does not tell it.
    """

    def __init__(
        self,
        observer: Observer,
        feeds: TopicFeeds,
        changed: Callable[[], None],
        refused: Callable[[], None],
    ) -> None:
        self.time_ns: int | None = None
        self._observer, self._feeds, self._changed, self._refused = observer, feeds, changed, refused
        self._listener: TopicListener | None = None
        self._decode = codec_for(ClockMessage).decode

    @property
    def refusal(self) -> str:
        """Why the user may not read the clock that there is; "" if that is not so."""
        return self._listener.refusal if self._listener is not None else ""

    def follow(self) -> None:
        """Look at the graph again: it may have changed."""
        offers = self._observer.around(CLOCK_TOPIC).endpoints(EntryKind.PUBLISHER, CLOCK_TOPIC)
        is_offered = any(each.topic_type == TYPE for each in offers)
        if is_offered and self._listener is None:
            with suppress(TooManyTopicsError):  # until another topic is closed
                self._listener = self._feeds.listen(CLOCK_TOPIC, self._receive, self._refused, TYPE)
        elif not is_offered and self._listener is not None:
            self.close()
            self._changed()

    def _receive(self, received: Received, _: bytes) -> None:
        try:
            now = self._decode(received.data).clock
        except InvalidMessageError:
            return
        self.time_ns = now.sec * 1_000_000_000 + now.nanosec
        self._changed()

    def close(self) -> None:
        """Follow it no more."""
        self.time_ns = None
        if self._listener is not None:
            self._listener.close()
            self._listener = None
