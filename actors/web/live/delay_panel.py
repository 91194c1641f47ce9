"""How old the messages of topics are on arrival."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, Final

import msgspec

from actors.interfaces.errors import InvalidMessageError
from actors.tools.stamps import stamp_of
from actors.web.live.panel import DocumentPanel
from actors.web.subscription_answer import SubscriptionRefusedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.live.panel import Body
    from actors.web.observer import Observer
    from actors.web.topic_feed import Received, TopicFeeds, TopicReader

MAX_TOPICS: Final = 64
"""Each is subscribed to."""


class DelayParameters(msgspec.Struct, forbid_unknown_fields=True):
    """The delays to measure.

    Attributes:
        topics: Full names.
    """

    topics: Annotated[list[str], msgspec.Meta(max_length=MAX_TOPICS)]


class DelayPanel(DocumentPanel):
    """The delays of topics, once a second, by the newest message of each that was sent since the beginning.

    Args:
        observer: Sets the pace.
        feeds: Read topics.
        parameters: The topics.
        wake: See `DocumentPanel`.

    Raises:
        InvalidTopicNameError, TooManyTopicsError: See `TopicFeeds.read`.
    """

    def __init__(
        self, observer: Observer, feeds: TopicFeeds, parameters: DelayParameters, wake: Callable[[], None]
    ) -> None:
        self._since_ns = time.time_ns()
        self._delays: dict[str, float] = {}
        self._newest: dict[str, Received] = {}
        """Messages that have not been looked at."""
        self._readers: dict[str, TopicReader] = {}
        try:
            for topic in dict.fromkeys(parameters.topics):
                self._readers[topic] = feeds.read(topic, 1, lambda: None)
        except BaseException:
            self._close_readers()
            raise
        super().__init__(wake, observer.on_sample)

    def pop(self) -> Body:
        """Take the newest message of each topic; return as documented."""
        for topic, reader in self._readers.items():
            with suppress(SubscriptionRefusedError):
                if taken := reader.pop():
                    self._newest[topic] = taken[-1]
        return super().pop()

    def document(self) -> dict[str, Any]:
        """Return `delays`: seconds by topic, by the stamp in the header if there is one, else since sent."""
        while self._newest:
            topic, received = self._newest.popitem()
            if received.info.source_timestamp >= self._since_ns:
                self._delays[topic] = self._delay(self._readers[topic], received)
        return {"delays": dict(self._delays)}

    def _delay(self, reader: TopicReader, received: Received) -> float:
        data, info = received
        try:
            stamp = stamp_of(reader.decode(data))
        except InvalidMessageError:
            stamp = None
        return (info.received_timestamp - (stamp or info.source_timestamp)) / 1e9

    def close(self) -> None:
        """Read no more."""
        super().close()
        self._close_readers()

    def _close_readers(self) -> None:
        for reader in self._readers.values():
            reader.close()
