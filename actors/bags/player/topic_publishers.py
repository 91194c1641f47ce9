"""The publishers of a player: one per topic name, and one for the clock."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from typing import TYPE_CHECKING, Any, Final

from actors.bags.player.played_service import PlayedService
from actors.bags.player.playing_qos import playing_qos
from actors.endpoints.publisher.publisher import MAX_STAMP_NS
from actors.errors import PublisherRefused, WaitTimeout
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rosbag2_interfaces.msg import ReadSplitEvent
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from actors.time.types import NANOSECONDS_PER_SECOND
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.bags.player.bag_source import BagSource
    from actors.bags.player.options import PlayerOptions
    from actors.bags.player.played_topic import DueMessage, PlayedTopic
    from actors.endpoints.publisher.publisher import Publisher
    from actors.node.node import Node

CLOCK_TOPIC: Final = "/clock"
CLOCK_QOS: Final = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
MAX_SEC: Final = 2**31 - 1
"""Greatest value of the field `sec` in a Time message."""


class TopicPublishers:
    """Publishes the messages of a bag.

    Args:
        node: The player's node.
        source: The topics. Those that cannot be played are added to its problems, and logged once.
        options: The names, the QoS and the clock.
    """

    def __init__(self, node: Node, source: BagSource, options: PlayerOptions) -> None:
        self._node = node
        self._source = source
        self._options = options
        self._log = node.get_logger()
        self._publishers: dict[str, Publisher[Any]] = {}
        """By topic name, after remapping."""
        self._refused: set[str] = set()
        self._clock: Publisher[Clock] | None = None
        for problem in source.problems:
            self._log.warning(problem)
        by_name: defaultdict[str, list[PlayedTopic]] = defaultdict(list)
        for topic in source.topics:
            if isinstance(topic, PlayedService):
                continue
            by_name[options.remappings.get(topic.name, topic.name)].append(topic)
        for name, topics in by_name.items():
            self._create(name, topics)
        self._splits = node.create_publisher(ReadSplitEvent, "events/read_split", 10)
        if options.publishes_clock:
            self._clock = node.create_publisher(Clock, CLOCK_TOPIC, CLOCK_QOS)

    def _create(self, name: str, topics: list[PlayedTopic]) -> None:
        """Create the publisher of the topics that are played on a name, or report why some are not played."""
        found: Publisher[Any] | None = None
        for topic in topics:
            if found is None:
                qos = self._options.qos_overrides.get(topic.name) or playing_qos(
                    qos for each in topics for qos in each.bag_topic.qos_profiles
                )
                try:
                    found = self._node.create_publisher(topic.msg_type, name, qos)
                except (CallboardError, TypeError, ValueError) as error:
                    self._report(f"'{escape(topic.name)}' is not played: {error}")
                    continue
                self._publishers[name] = found
            elif found.msg_type is not topic.msg_type:
                self._report(
                    f"A part of '{escape(topic.name)}' is not played: it has the type"
                    f" {escape(topic.bag_topic.type_name)}, unlike the rest, and a topic has one type"
                )
                continue
            topic.publisher = found

    def _report(self, problem: str) -> None:
        self._source.problems.append(problem)
        self._log.warning(problem)

    @property
    def dropped(self) -> int:
        """Number of messages that did not leave the node."""
        return sum(each.dropped for each in self._publishers.values())

    async def publish(self, message: DueMessage) -> None:
        """Publish a message as soon as its publisher has room: better late than lost.

        Args:
            message: The message.
        """
        topic, data, time_ns, publish_time_ns, _ = message
        publisher, clock_topics = topic.publisher, self._options.clock_topics
        assert publisher is not None
        try:
            await publisher.ready(None)
            if clock_topics is None or topic.name in clock_topics:
                self.publish_clock(time_ns)
            publisher.publish_encoded(data, min(publish_time_ns, MAX_STAMP_NS))
            topic.published += 1
        except PublisherRefused as error:
            if topic.name not in self._refused:
                self._refused.add(topic.name)
                self._report(str(error))

    def publish_split(self, closed: str, opened: str) -> None:
        """Tell that the messages of a further file begin.

        Args:
            closed: The file before.
            opened: That file.
        """
        name = self._node.get_fully_qualified_name()
        self._splits.publish(ReadSplitEvent(closed_file=closed, opened_file=opened, node_name=name))

    def publish_clock(self, time_ns: int) -> None:
        """Publish the time of the bag on `/clock`, if the options ask for that.

        Args:
            time_ns: The time of the bag.
        """
        if self._clock is not None:
            sec, nanosec = divmod(time_ns, NANOSECONDS_PER_SECOND)
            self._clock.publish(Clock(clock=Time(sec=min(sec, MAX_SEC), nanosec=nanosec)))

    async def flush(self, limit_sec: float | None) -> None:
        """Wait until all messages have reached the broker; log those that have not.

        Args:
            limit_sec: Seconds to wait at most; None for no limit.
        """
        loop = asyncio.get_running_loop()
        end = loop.time() + (limit_sec or 0)
        for publisher in self._publishers.values():
            try:
                await publisher.flush(None if limit_sec is None else max(end - loop.time(), 0.0))
            except (WaitTimeout, PublisherRefused) as error:
                self._log.warning(str(error))
