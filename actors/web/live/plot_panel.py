"""Numbers of a topic over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Final

import msgspec

from actors.interfaces.errors import InvalidMessageError
from actors.tools.field_paths import InvalidFieldError, require_path, value_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.live.panel import Body
    from actors.web.topic_feed import Received, TopicFeeds, TopicReader

POINTS_PER_UPDATE: Final = 1000
"""Points of one update; further ones are counted."""

MAX_FIELDS: Final = 16


class PlotParameters(msgspec.Struct, forbid_unknown_fields=True):
    """The values to plot.

    Attributes:
        topic: Its full name.
        fields: Paths of fields, such as `pose.position.x` or `ranges[3]`.
    """

    topic: str
    fields: Annotated[list[str], msgspec.Meta(min_length=1, max_length=MAX_FIELDS)]


class PlotPanel:
    """Points of fields of one topic.

    Args:
        feeds: Read topics.
        parameters: The topic and its fields.
        wake: Called when there are points.

    Raises:
        InvalidFieldError: A path is malformed.
        InvalidTopicNameError, TooManyTopicsError: See `TopicFeeds.read`.
    """

    def __init__(self, feeds: TopicFeeds, parameters: PlotParameters, wake: Callable[[], None]) -> None:
        self._fields = parameters.fields
        for path in self._fields:
            require_path(path)
        self._reader: TopicReader = feeds.read(parameters.topic, POINTS_PER_UPDATE, wake)

    def pop(self) -> Body | None:
        """Return `points`, each a list of its time in seconds and the values, and how many were `skipped`.

        A value is null if a message has no such field, or no finite number there.
        """
        reader = self._reader
        taken = reader.pop()
        if not taken:
            return None
        skipped, reader.skipped = reader.skipped, 0
        return lambda: {"points": [self._point(each) for each in taken], "skipped": skipped}

    def _point(self, received: Received) -> list[float | None]:
        time_sec = received.info.source_timestamp / 1e9
        try:
            message = self._reader.decode(received.data)
        except InvalidMessageError:
            return [time_sec, *[None] * len(self._fields)]
        return [time_sec, *(_number(message, path) for path in self._fields)]

    def close(self) -> None:
        """Read no more."""
        self._reader.close()


def _number(message: Any, path: str) -> float | None:
    try:
        value = value_at(message, path)
    except InvalidFieldError:
        return None
    return value if isinstance(value, (int, float)) and math.isfinite(value) else None
