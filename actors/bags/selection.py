"""Selects the topics to record or play, by the rules of ROS 2's recorder. Pure.

A service is selected by its own name, and stands for the events of its calls on `<service>/_service_event`.
An action stands for its topics and the events of its three services.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bags.errors import InvalidBagOptionError
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
        types: The types that its publishers and subscriptions declare.
        publishers: Number of its publishers.
        subscriptions: Number of its subscriptions, without the recorder's own.
    """

    name: str
    types: frozenset[str]
    publishers: int
    subscriptions: int


@dataclass(frozen=True, kw_only=True)
class Selection:
    """The topics, services and actions to record or play.

    Args:
        topics, services, actions: Full names to select.
        topic_types: Types whose topics to select.
        all_topics, all_services, all_actions: Select all that are not hidden, whatever the names and `regex`
            say.
        regex: Also select topics, services and actions whose names contain a match; "" for none.
        exclude_regex: Exclude topics, services and actions whose names contain a match; "" for none.
        exclude_topics, exclude_services, exclude_actions: Full names to exclude.
        exclude_topic_types: Types whose topics to exclude.
        include_hidden_topics: Also select topics with a token that begins with `_`.
        include_unpublished_topics: Also record topics without a publisher. The recorder subscribes to those
            in `topics` in any case, so that it receives the first message of their first publisher.
        ignore_leaf_topics: Do not record topics that nobody else subscribes to.

    Raises:
        InvalidBagOptionError: Nothing is selected, or a regular expression is invalid.
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
            raise InvalidBagOptionError(
                "Nothing is selected: name topics, services, actions or types, give a regular expression, or"
                " select all"
            )
        object.__setattr__(self, "_wanted", _compiled(self.regex))
        object.__setattr__(self, "_unwanted", _compiled(self.exclude_regex))

    def selects(self, topic: TopicState) -> bool:
        """Return whether to record a topic.

        Args:
            topic: The topic in the present graph. One with several types is not selected.
        """
        if len(topic.types) != 1 or not self.selects_name(topic.name, *topic.types):
            return False
        if not topic.publishers and not self.include_unpublished_topics:
            return False
        return bool(topic.subscriptions) or not self.ignore_leaf_topics

    def selects_name(self, name: str, type_name: str) -> bool:
        """Return whether to record a topic, provided that it has a publisher and a subscription.

        Args:
            name: The topic's full name.
            type_name: The topic's type.
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
        """Return whether to record a service or an action."""
        if not (select_all or name in names or self._finds(name)):
            return False
        return name not in excluded and not self._excludes(name)

    def _finds(self, name: str) -> bool:
        return self._wanted is not None and self._wanted.search(name) is not None

    def _excludes(self, name: str) -> bool:
        return self._unwanted is not None and self._unwanted.search(name) is not None

    @property
    def awaited_topics(self) -> frozenset[str]:
        """The topics to record as soon as they appear, whatever their type is."""
        if self.exclude_topic_types:
            return frozenset()
        return frozenset(each for each in self.topics if self.selects_name(each, ""))


def _compiled(text: str) -> re.Pattern[str] | None:
    try:
        return re.compile(text) if text else None
    except re.error as error:
        raise InvalidBagOptionError(f"{text!r} is not a valid regular expression: {error}") from None
