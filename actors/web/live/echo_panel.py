"""The messages of a topic as trees of fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.interfaces.errors import InvalidMessageError
from actors.tools.stamps import stamp_of
from actors.web.javascript_values import TooManyValuesError, message_to_javascript

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.live.panel import Body
    from actors.web.topic_feed import Received, TopicFeeds, TopicReader

MESSAGES_PER_UPDATE: Final = 20
"""Messages of one update; further ones are counted."""

SHOWN_LENGTH: Final = 512
"""Characters or elements of a string or sequence that are shown."""


class EchoParameters(msgspec.Struct, forbid_unknown_fields=True):
    """The topic and the messages to show.

    Attributes:
        topic: Its full name.
        type: The type whose messages are shown, where the topic has several; empty for all.
    """

    topic: str
    type: str = ""


class EchoPanel:
    """The newest messages of a topic.

    Args:
        feeds: Read topics.
        parameters: The topic and the type.
        wake: Called when there are messages.

    Raises:
        InvalidTopicNameError, TooManyTopicsError: See `TopicFeeds.read`.
    """

    def __init__(self, feeds: TopicFeeds, parameters: EchoParameters, wake: Callable[[], None]) -> None:
        self._reader: TopicReader = feeds.read(parameters.topic, MESSAGES_PER_UPDATE, wake, parameters.type)

    def pop(self) -> Body | None:
        """Return `messages`, and how many were `skipped` before them."""
        reader = self._reader
        taken = reader.pop()
        if not taken:
            return None
        skipped, reader.skipped = reader.skipped, 0
        return lambda: {"messages": [message_document(each, reader) for each in taken], "skipped": skipped}

    def close(self) -> None:
        """Read no more."""
        self._reader.close()


def message_document(received: Received, reader: TopicReader) -> dict[str, Any]:
    """Return a message for JSON: `node`, `sent_ns`, `delay_sec`, `bytes`, and `message` or `error`.

    Where the header has a stamp, `header_delay_sec` is the age of that on arrival.
    """
    info = received.info
    found: dict[str, Any] = {
        "node": info.publisher_node,
        "sent_ns": info.source_timestamp,
        "delay_sec": (info.received_timestamp - info.source_timestamp) / 1e9,
        "bytes": len(received.data),
    }
    try:
        message = reader.decode(received.data)
        found["message"] = message_to_javascript(message, SHOWN_LENGTH)
    except (InvalidMessageError, TooManyValuesError) as error:
        found["error"] = str(error)
    else:
        if stamp := stamp_of(message):
            found["header_delay_sec"] = (info.received_timestamp - stamp) / 1e9
    return found
