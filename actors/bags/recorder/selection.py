"""Which topics of a graph are recorded, by the rules of ROS 2's recorder. Pure.

Services are recorded as the events of their calls, on `<service>/_service_event`; actions as their topics and
the events of their three services. Names are compared with the names of services and actions, not with those
of these topics.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bags.recorder.errors import InvalidRecordingError
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Collection

SERVICE_EVENT: Final = "/_service_event"
_ACTION: Final = re.compile(
    r"(.+)/_action/(?:feedback|status|(?:send_goal|cancel_goal|get_result)/_service_event)"
)


class TopicState(NamedTuple):
    """A topic of the graph.

    Attributes:
        name: Its full name.
        types: The types that its publishers and subscriptions have declared.
        publishers: How many publishers it has.
        subscriptions: How many subscriptions it has, without the recorder's own.
    """

    name: str
    types: frozenset[str]
    publishers: int
    subscriptions: int


@dataclass(frozen=True, kw_only=True)
class Selection:
    """What is recorded.

    Args:
        topics, services, actions: Full names.
        topic_types: Types whose topics are recorded.
        all_topics, all_services, all_actions: Record all that are not hidden; names and `regex` do not
            matter then.
        regex: Also record the topics, services and actions in whose names this is found; "" for none.
        exclude_regex: Record none in whose names this is found; "" for none.
        exclude_topics, exclude_services, exclude_actions: Full names of what is not recorded.
        exclude_topic_types: Types whose topics are not recorded.
        include_hidden_topics: Record topics with a token that begins with `_`, too.
        include_unpublished_topics: Record topics without a publisher, too. Those in `topics` are subscribed
            to in any case, so that the first message of their first publisher is recorded.
        ignore_leaf_topics: Do not record topics that nobody else subscribes to.

    Raises:
        InvalidRecordingError: Nothing is selected, or a regular expression is none.
    """

    topics: Collection[str] = ()
    services: Collection[str] = ()
    actions: Collection[str] = ()
    topic_types: Collection[str] = ()
    all_topics: bool = False
    all_services: bool = False
    all_actions: bool = False
    regex: str = ""
    exclude_regex: str = ""
    exclude_topics: Collection[str] = ()
    exclude_services: Collection[str] = ()
    exclude_actions: Collection[str] = ()
    exclude_topic_types: Collection[str] = ()
    include_hidden_topics: bool = False
    include_unpublished_topics: bool = False
    ignore_leaf_topics: bool = False
    _wanted: re.Pattern[str] | None = field(init=False, repr=False, compare=False)
    _unwanted: re.Pattern[str] | None = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        named = self.topics or self.services or self.actions or self.topic_types or self.regex
        if not (named or self.all_topics or self.all_services or self.all_actions):
            raise InvalidRecordingError(
                "Nothing is selected: name topics, services, actions or types, give a regular expression, or"
                " select all"
            )
        object.__setattr__(self, "_wanted", _compiled(self.regex))
        object.__setattr__(self, "_unwanted", _compiled(self.exclude_regex))

    def selects(self, topic: TopicState) -> bool:
        """Return whether a topic is recorded.

        Args:
            topic: It, as the graph has it now. A topic of several types is not recorded.
        """
        if len(topic.types) != 1 or not self.selects_name(topic.name, *topic.types):
            return False
        if not topic.publishers and not self.include_unpublished_topics:
            return False
        return bool(topic.subscriptions) or not self.ignore_leaf_topics

    def selects_name(self, name: str, type_name: str) -> bool:
        """Return whether a topic is recorded while it has a publisher, and a subscription.

        Args:
            name: The full name.
            type_name: The type.
        """
        if action := _ACTION.fullmatch(name):
            return self._selects_other(
                action[1], select_all=self.all_actions, names=self.actions, excluded=self.exclude_actions
            )
        if name.endswith(SERVICE_EVENT):
            return self._selects_other(
                name.removesuffix(SERVICE_EVENT),
                select_all=self.all_services,
                names=self.services,
                excluded=self.exclude_services,
            )
        if not (self.all_topics or name in self.topics or type_name in self.topic_types or self._finds(name)):
            return False
        if name in self.exclude_topics or type_name in self.exclude_topic_types or self._excludes(name):
            return False
        return self.include_hidden_topics or not is_hidden(name)

    def _selects_other(
        self, name: str, *, select_all: bool, names: Collection[str], excluded: Collection[str]
    ) -> bool:
        """Return whether a service or an action is recorded."""
        if not (select_all or name in names or self._finds(name)):
            return False
        return name not in excluded and not self._excludes(name)

    def _finds(self, name: str) -> bool:
        return self._wanted is not None and self._wanted.search(name) is not None

    def _excludes(self, name: str) -> bool:
        return self._unwanted is not None and self._unwanted.search(name) is not None

    @property
    def awaited_topics(self) -> frozenset[str]:
        """The topics that are recorded whenever they appear, whatever their type."""
        if self.exclude_topic_types:
            return frozenset()
        return frozenset(each for each in self.topics if self.selects_name(each, ""))


def _compiled(text: str) -> re.Pattern[str] | None:
    try:
        return re.compile(text) if text else None
    except re.error as error:
        raise InvalidRecordingError(f"{text!r} is no regular expression: {error}") from None
