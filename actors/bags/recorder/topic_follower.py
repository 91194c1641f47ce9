"""Follows the graph, and subscribes to selected topics as they appear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.bags.recorder.message_collector import Source
from actors.bags.recorder.recorded_topic import RecordedTopic
from actors.bags.recorder.recording_qos import recording_qos, unheard
from actors.bags.selection import TopicState
from actors.errors import BrokerUnreachable
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.logging.limited_lines import LimitedLines
from actors.qos.profile import QoSProfile
from actors.tools.graph_types import TOPIC_KINDS, GraphTypes
from proto.untrusted_text import peer_text
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from actors.bags.recorder.options import RecorderOptions
    from actors.bags.selection import Selection
    from actors.endpoints.subscription.subscription import Subscription
    from actors.graph.snapshot import GraphSnapshot
    from actors.node.node import Node

MAX_TOPICS: Final = 10_000
"""Limit for recorded topics, more than any robot has, so that nodes which keep inventing topics cannot fill
the memory."""


class _Endpoints:
    """The endpoints of a topic in the graph."""

    __slots__ = ("offers", "publishers", "subscriptions", "types")

    def __init__(self) -> None:
        self.types: set[str] = set()
        self.offers: list[tuple[QoSProfile, bool]] = []
        """The QoS of each publisher, and whether it is strict."""
        self.publishers = self.subscriptions = 0

    def state(self, name: str) -> TopicState:
        """Return the topic's state for the selection."""
        return TopicState(name, frozenset(self.types), self.publishers, self.subscriptions)


class TopicFollower:
    """Subscribes to selected topics as they appear, and stays subscribed until the end.

    Args:
        node: The recorder's node.
        selection: The topics to record.
        options: How to record them.
        begin: Called with each new topic, before its first message is taken.

    Attributes:
        sources: The recorded topics, by name.
    """

    def __init__(
        self,
        node: Node,
        selection: Selection,
        options: RecorderOptions,
        begin: Callable[[Source], object],
    ) -> None:
        self._node = node
        self._selection = selection
        self._lossless = options.lossless
        self._overrides = options.qos_overrides
        self._begin = begin
        self._types = GraphTypes(node)
        self._log = node.get_logger()
        self._lines = LimitedLines(self._log.warning)
        self._news = LimitedLines(self._log.info)
        self._early: dict[str, Subscription[Any]] = {}
        """Subscriptions to named topics whose type is not known yet."""
        self._warned: set[str] = set()
        """Topics about which a warning has been logged."""
        self._has_looked = False
        self.sources: dict[str, Source] = {}

    async def look(self, snapshot: GraphSnapshot, names: Collection[str]) -> None:
        """Subscribe to selected topics that are not recorded yet.

        Args:
            snapshot: The graph.
            names: The topics that have changed; all topics in the first call.
        """
        found = self._endpoints(snapshot, names)
        for name, endpoints in found.items():
            if name in self.sources:
                self._check_offers(name, endpoints)
            elif len(endpoints.types) > 1 and any(
                self._selection.selects_name(name, each) for each in endpoints.types
            ):
                self._give_up(name, f"it has several types ({', '.join(sorted(endpoints.types))})")
            elif self._selection.selects(endpoints.state(name)):
                await self._subscribe(snapshot, name, endpoints)
        if not self._has_looked:
            self._has_looked = True
            self._subscribe_early()

    def _endpoints(self, snapshot: GraphSnapshot, names: Collection[str]) -> Mapping[str, _Endpoints]:
        """Return the endpoints of topics in the graph, without the recorder's own subscriptions."""
        own = self._node.get_fully_qualified_name()
        found: dict[str, _Endpoints] = {}
        for entry in snapshot.of_kind(*TOPIC_KINDS):
            if entry.name not in names:
                continue
            is_publisher = entry.kind == EntryKind.PUBLISHER
            if entry.node == own and not is_publisher:
                continue
            topic = found.setdefault(entry.name, _Endpoints())
            topic.types.update({entry.type_name} - {""})
            if is_publisher:
                topic.publishers += 1
                topic.offers.append((QoSProfile.from_wire(entry.qos), entry.qos.get("strict") is True))
            else:
                topic.subscriptions += 1
        return found

    async def _subscribe(self, snapshot: GraphSnapshot, name: str, endpoints: _Endpoints) -> None:
        """Start to record a topic."""
        if len(self.sources) >= MAX_TOPICS:
            self._warn("", f"At most {MAX_TOPICS:,} topics can be recorded; others are left out")
            return
        try:
            msg_type = await self._types.message(snapshot, name, *endpoints.types)
            topic = RecordedTopic(name, msg_type, [offered for offered, _ in endpoints.offers])
        except (UnknownInterfaceError, InvalidMessageError, BrokerUnreachable, TypeError) as error:
            self._give_up(name, str(error))
            return
        subscription = self._early.pop(name, None)
        if subscription is None:
            qos = self._overrides.get(name) or recording_qos(endpoints.offers, lossless=self._lossless)
            subscription = self._node.create_subscription(msg_type, name, None, qos, raw=True)
        source = self.sources[name] = Source(topic, subscription)
        if self._news.admits("topics that are recorded"):
            self._log.info(f"Subscribed to topic '{name}'")
        self._begin(source)
        self._check_offers(name, endpoints)

    def _subscribe_early(self) -> None:
        """Subscribe to named topics that do not exist yet, so that their first messages arrive."""
        for name in self._selection.awaited_topics - self.sources.keys() - self._warned:
            qos = self._overrides.get(name) or recording_qos((), lossless=self._lossless)
            self._early[name] = self._node.create_subscription(None, name, None, qos, raw=True)

    def _give_up(self, name: str, reason: str) -> None:
        """Log why a topic is not recorded, and end an early subscription to it."""
        early = self._early.pop(name, None)
        if early is not None:
            early.destroy()
        self._warn(name, reason)

    def _check_offers(self, name: str, endpoints: _Endpoints) -> None:
        """Warn of strict publishers that appeared later and do not match the subscription."""
        reason = unheard(endpoints.offers, self.sources[name].subscription.qos_profile)
        if reason:
            self._warn(name, f"a publisher with strict QoS does not match the recorder: {reason}")

    def _warn(self, name: str, reason: str) -> None:
        """Log, once per topic, why it is not recorded or only from some publishers."""
        if name in self._warned or len(self._warned) > MAX_TOPICS:
            return
        self._warned.add(name)
        if self._lines.admits("topics that are not recorded"):
            where = f"Topic '{name}': " if name in self.sources else f"Topic '{name}' is not recorded: "
            self._log.warning(peer_text(f"{where if name else ''}{reason}"))

    def close(self) -> None:
        """Destroy all subscriptions."""
        for each in (*self._early.values(), *(source.subscription for source in self.sources.values())):
            each.destroy()
        self._early.clear()
        self._lines.close()
        self._news.close()
