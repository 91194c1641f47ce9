"""Simulated time of the graph, while anybody wants to know it."""

from __future__ import annotations

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

    Attributes:
        is_present: Whether there is simulated time.
        time_ns: The time; 0 before the first message.
    """

    def __init__(self, observer: Observer, feeds: TopicFeeds, changed: Callable[[], None]) -> None:
        self.is_present = False
        self.time_ns = 0
        self._observer, self._feeds, self._changed = observer, feeds, changed
        self._listener: TopicListener | None = None
        self._decode = codec_for(ClockMessage).decode

    def follow(self) -> None:
        """Look at the graph again: it may have changed."""
        offers = self._observer.around(CLOCK_TOPIC).endpoints(EntryKind.PUBLISHER, CLOCK_TOPIC)
        is_present = any(each.topic_type == TYPE for each in offers)
        if is_present is self.is_present:
            return
        self.is_present = is_present
        if is_present:
            try:
                self._listener = self._feeds.listen(CLOCK_TOPIC, self._receive, lambda: None, TYPE)
            except TooManyTopicsError:
                self.is_present = False  # until another topic is closed
        else:
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
        self.is_present, self.time_ns = False, 0
        if self._listener is not None:
            self._listener.close()
            self._listener = None
