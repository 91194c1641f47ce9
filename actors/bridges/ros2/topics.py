"""Topics that cross: which subscriptions receive on one side, and which mirrors publish on the other."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.crossing import Crossing
from actors.bridges.qos import receiver_of
from actors.bridges.ros2.patient_publisher import LINGER_SEC, PatientPublisher
from actors.errors import PublisherRefused
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.bridges.counters import Counts
    from actors.bridges.plan import Mirror
    from actors.bridges.ros2.endpoints import RosSubscription
    from actors.bridges.ros2.message_taker import RosMessageInfo
    from actors.bridges.ros2.observer import Observer
    from actors.bridges.ros2.participant import RosNode
    from actors.bridges.ros2.types import MessageTypes
    from actors.endpoints.publisher.publisher import Publisher
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.endpoints.subscription.subscription import Subscription
    from actors.node.bare_node import BareNode

DEPARTED: Final = QoSProfile(depth=100)
"""The QoS for messages of publishers that left before the graph showed what they offer: that of most."""
REPLAYS: Final = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""The QoS that brings latched messages again."""
REPLAY_SEC: Final = 30.0
"""How long they may take: then all have arrived, also on a busy machine. Each new message arrives twice
meanwhile."""


class TopicFromRos:
    """One topic of ROS 2, received there and published by mirrors here.

    Every subscription of callboard has a mirror in ROS 2, but only one of them receives messages: the others
    exist to be seen, and keep no more than they must. If publishers offer different QoS, one receives for
    each profile of the plan's intake.

    Args:
        topic: The name of the topic in ROS 2.
        types: Its type.
        observer: Knows the nodes and offers of publishers.
        control: The bridge's own node in ROS 2, for subscriptions with profiles that no mirror has.
        counts: Counts what crosses.
        convert: Converts a message of ROS 2 to one of callboard; raises InvalidMessageError.
    """

    def __init__(
        self,
        topic: str,
        types: MessageTypes,
        observer: Observer,
        control: RosNode,
        counts: Counts,
        *,
        convert: Callable[[bytes], bytes],
    ) -> None:
        self._topic = topic
        self._types = types
        self._observer = observer
        self._control = control
        self._crossing = Crossing(convert, counts, self._node_of)
        self._publishers: dict[Mirror, Publisher[Any]] = {}
        self._shown: dict[Mirror, RosSubscription] = {}
        """The mirrors of subscriptions."""
        self._nodes: dict[Mirror, RosNode] = {}
        """The nodes that they are shown on."""
        self._deep: dict[QoSProfile, Mirror] = {}
        """By profile, the mirror that keeps as many messages as the profile says, so that it can receive."""
        self._own: dict[QoSProfile, RosSubscription] = {}
        """Subscriptions of the bridge itself, for profiles that no mirror has."""
        self._receivers: dict[QoSProfile, RosSubscription] = {}
        """By profile of the intake, the subscription that receives."""
        self._profiles: tuple[QoSProfile, ...] = ()
        self._replays = _Replays(self._replay_subscription)
        self._leaving: set[RosSubscription] = set()
        """Subscriptions that go on receiving for a moment, though their mirrors have gone or changed."""

    @property
    def is_idle(self) -> bool:
        """Whether nothing is shown or received any more."""
        return not (self._publishers or self._shown or self._own or self._leaving)

    @property
    def is_received(self) -> bool:
        """Whether its messages are received now."""
        return bool(self._receivers)

    def is_connected(self) -> bool:
        """Return whether DDS has matched a subscription that receives, so that nothing new is missed."""
        return any(each.publisher_count() for each in self._receivers.values())

    def receive_now(self) -> None:
        """Receive what has arrived, before the loop would do so."""
        for each in tuple(self._receivers.values()):
            each.take_now()

    def publisher_on(self, node: str) -> Publisher[Any] | None:
        """Return a publisher that is shown on a node in callboard; None if there is none."""
        return next((each for mirror, each in self._publishers.items() if mirror.node == node), None)

    def drop_refused(self, is_publisher: Callable[[str, str], bool]) -> None:
        """Drop messages of publishers that do not cross.

        Args:
            is_publisher: Returns whether the last plan knew a node as a publisher of a topic.
        """
        self._crossing.drop_refused(lambda node: is_publisher(node, self._topic))

    def look_again(self) -> None:
        """Find the nodes of publishers whose messages arrived before the graph showed them."""
        self._crossing.look_again()

    def _node_of(self, gid: bytes) -> str | None:
        return self._observer.node_of(self._topic, gid)

    def add_publisher(self, mirror: Mirror, bare: BareNode) -> Publisher[Any]:
        """Show a publisher of ROS 2 on a node in callboard, which publishes its messages from now on."""
        assert mirror.qos is not None
        publisher = bare.create_publisher(self._types.ours, mirror.name, mirror.qos)
        self._publishers[mirror] = publisher

        def send(data: bytes, stamp_ns: int) -> None:
            if publisher.refusal:  # by the broker; publishing does not raise for it
                raise PublisherRefused(publisher.refusal)
            publisher.publish_encoded(data, stamp_ns)

        self._crossing.add_mirror(mirror.source_node, send)
        return publisher

    def add_subscription(self, mirror: Mirror, node: RosNode) -> None:
        """Show a subscription of callboard on a node in ROS 2."""
        qos = mirror.qos
        assert qos is not None
        is_deep = qos not in self._deep
        profile = qos if is_deep else replace(qos, history=HistoryPolicy.KEEP_LAST, depth=1)
        self._shown[mirror] = self._subscription(node, profile)
        self._nodes[mirror] = node
        if is_deep:
            self._deep[qos] = mirror

    def _subscription(self, node: RosNode, qos: QoSProfile) -> RosSubscription:
        return node.create_subscription(self._types.theirs, self._topic, qos)

    def remove(self, mirror: Mirror, *, is_replaced: bool = False) -> float:
        """Hide a publisher or subscription.

        Args:
            mirror: Its mirror.
            is_replaced: Whether it is a latched publisher that is made again, and needs what it kept.

        Returns:
            The seconds until it is destroyed. A new publisher of ROS 2 may have sent messages to this
            subscription, and DDS needs a moment to match the subscription that follows.
        """
        if mirror in self._publishers:
            self._publishers.pop(mirror).destroy()
            if is_replaced:
                self._crossing.replace_mirror(mirror.source_node)
            else:
                self._crossing.remove_mirror(mirror.source_node)
        elif mirror in self._shown:
            subscription = self._shown.pop(mirror)
            del self._nodes[mirror]
            is_deep = mirror in self._deep.values()
            self._deep = {qos: each for qos, each in self._deep.items() if each != mirror}
            self._receivers = {qos: each for qos, each in self._receivers.items() if each is not subscription}
            if is_deep and mirror.qos is not None:
                self._leaving.add(subscription)
                subscription.listen(partial(self._accept, mirror.qos))
                asyncio.get_running_loop().call_later(LINGER_SEC, self._left, subscription)
                return LINGER_SEC
            subscription.destroy()
        return 0.0

    def _left(self, subscription: RosSubscription) -> None:
        if subscription in self._leaving:
            self._leaving.discard(subscription)
            subscription.destroy()

    def set_intake(self, profiles: tuple[QoSProfile, ...]) -> None:
        """Receive with these subscriptions, and with no others, from now on.

        Args:
            profiles: The QoS of the subscriptions that receive, the strongest first; none to receive nothing.

        Raises:
            RosError: ROS 2 refuses a subscription.
        """
        if not self._profiles:  # otherwise gaps in the numbers are losses, also those of this change
            self._crossing.begin()
        self._profiles = profiles
        for qos in tuple(self._receivers):
            if qos not in profiles:
                self._receivers.pop(qos).listen(None)
        for qos in profiles:
            if qos not in self._receivers:
                self._receivers[qos] = self._receiver(qos)
        for qos, subscription in tuple(self._own.items()):
            if self._receivers.get(qos) is not subscription:
                del self._own[qos]
                subscription.destroy()
        self._replays.follow(self._crossing, is_received=bool(profiles))

    def _replay_subscription(self) -> RosSubscription:
        subscription = self._subscription(self._control, REPLAYS)
        subscription.listen(
            lambda data, info: self._crossing.replay(data, info.gid, info.sequence, _stamp_of(info))
        )
        return subscription

    def _receiver(self, qos: QoSProfile) -> RosSubscription:
        if qos in self._deep:
            subscription = self._shown[self._deep[qos]]
        elif mirror := next((each for each in self._shown if each.qos == qos), None):
            # The mirror that received has gone: another one keeps more from now on.
            subscription = self._subscription(self._nodes[mirror], qos)
            self._shown[mirror].destroy()
            self._shown[mirror] = subscription
            self._deep[qos] = mirror
        else:
            subscription = self._own.get(qos) or self._subscription(self._control, qos)
            self._own[qos] = subscription
        subscription.listen(partial(self._received, qos))
        return subscription

    def _accept(self, qos: QoSProfile, data: bytes, info: RosMessageInfo) -> None:
        profiles = self._profiles
        if len(profiles) > 1:
            # Every publisher matches the weakest profile, too, but each message crosses once.
            offer = self._observer.offer_of(self._topic, info.gid)
            if profiles[len(profiles) - 1 if offer is None else receiver_of(profiles, offer)] != qos:
                return
        self._crossing.receive(data, info.gid, info.sequence, _stamp_of(info))

    def _received(self, qos: QoSProfile, data: bytes, info: RosMessageInfo) -> None:
        # Older messages may have arrived at subscriptions that leave, and would count as repeated after this.
        for each in tuple(self._leaving):
            each.take_now()
        self._accept(qos, data, info)

    def close(self) -> None:
        """Hide everything, and receive nothing."""
        for mirror in (*self._publishers, *self._shown):
            self.remove(mirror)
        for subscription in tuple(self._leaving):
            self._left(subscription)
        self.set_intake(())


class TopicFromCallboard:
    """One topic of callboard, received here and published by mirrors in ROS 2.

    Args:
        topic: The name of the topic in callboard.
        types: Its type.
        own: The bridge's own node in callboard, for subscriptions with profiles that no mirror has.
        control: The bridge's own node in ROS 2, for messages of nodes that have gone.
        counts: Counts what crosses.
        theirs: The name of the topic in ROS 2.
        convert: Converts a message of callboard to one of ROS 2; raises InvalidMessageError.
    """

    def __init__(
        self,
        topic: str,
        types: MessageTypes,
        own: BareNode,
        control: RosNode,
        counts: Counts,
        *,
        theirs: str,
        convert: Callable[[bytes], bytes],
    ) -> None:
        self._topic = topic
        self._theirs = theirs
        self._types = types
        self._node = own
        self._control = control
        # Messages of callboard name the node that published them.
        self._crossing = Crossing(convert, counts, lambda _: "")
        self._counts = counts
        self._publishers: dict[Mirror, PatientPublisher] = {}
        self._leaving: set[PatientPublisher] = set()
        self._subscriptions: dict[Mirror, Subscription[Any]] = {}
        self._own: dict[QoSProfile, Subscription[Any]] = {}
        """Subscriptions with the profiles that no mirror has."""
        self._replays = _Replays(self._replay_subscription)
        self._profiles: tuple[QoSProfile, ...] = ()
        self._receiver_by_node: Mapping[str, int] = {}

    @property
    def is_idle(self) -> bool:
        """Whether nothing is shown or received any more."""
        return not (self._publishers or self._leaving or self._subscriptions or self._own)

    @property
    def subscription(self) -> Subscription[Any] | None:
        """A subscription that receives; None if ROS 2 has no subscription."""
        return next(iter(self._subscriptions.values()), None)

    def add_publisher(self, mirror: Mirror, node: RosNode) -> None:
        """Show a publisher of callboard on a node in ROS 2, which publishes its messages from now on."""
        assert mirror.qos is not None
        publisher = PatientPublisher(
            node.create_publisher(self._types.theirs, mirror.name, mirror.qos),
            self._counts,
            asyncio.get_running_loop(),
        )
        self._publishers[mirror] = publisher
        self._crossing.add_mirror(mirror.source_node, publisher.publish)

    def drop_refused(self, is_publisher: Callable[[str, str], bool]) -> None:
        """Drop messages of publishers that do not cross.

        Args:
            is_publisher: Returns whether the last plan knew a node as a publisher of a topic.
        """
        self._crossing.drop_refused(lambda node: is_publisher(node, self._topic))

    def publish_for_departed(self, is_here: Callable[[str], bool]) -> None:
        """Publish messages of nodes that left before they had a mirror.

        Args:
            is_here: Returns whether callboard's graph has a native node of a name.
        """
        for node in self._crossing.waiting:
            if is_here(node):
                continue
            publisher = PatientPublisher(
                self._control.create_publisher(self._types.theirs, self._theirs, DEPARTED),
                self._counts,
                asyncio.get_running_loop(),
            )
            self._crossing.send_held(node, publisher.publish)
            self._leaving.add(publisher)
            publisher.leave(partial(self._left, "", publisher))

    def add_subscription(self, mirror: Mirror, bare: BareNode) -> Subscription[Any]:
        """Show a subscription of ROS 2 on a node in callboard; it receives."""
        assert mirror.qos is not None
        subscription = self._subscriptions[mirror] = self._subscription(bare, mirror.qos)
        return subscription

    def _subscription(self, node: BareNode, qos: QoSProfile) -> Subscription[Any]:
        received = partial(self._received, qos)
        return node.create_subscription(self._types.ours, self._topic, received, qos, raw=True)

    def remove(self, mirror: Mirror, *, is_replaced: bool = False) -> float:
        """Hide a publisher or subscription.

        Args:
            mirror: Its mirror.
            is_replaced: Whether it is a latched publisher that is made again, and needs what it kept.

        Returns:
            The seconds until it is destroyed: the last messages of its original may still arrive, and must be
            sent.
        """
        if mirror in self._publishers:
            publisher = self._publishers.pop(mirror)
            if is_replaced:
                self._crossing.replace_mirror(mirror.source_node, publisher.publish)
            else:
                self._crossing.retire_mirror(mirror.source_node, publisher.publish)
            self._leaving.add(publisher)
            seconds = publisher.leave(partial(self._left, mirror.source_node, publisher))
            if not seconds:
                self._left(mirror.source_node, publisher)
            return seconds
        if mirror in self._subscriptions:
            self._subscriptions.pop(mirror).destroy()
        return 0.0

    def _left(self, node: str, publisher: PatientPublisher) -> None:
        self._leaving.discard(publisher)
        self._crossing.remove_mirror(node, publisher.publish)

    def set_intake(self, profiles: tuple[QoSProfile, ...], receivers: Mapping[str, int]) -> None:
        """Receive with further subscriptions, if publishers offer different QoS.

        Args:
            profiles: As for `TopicFromRos.set_intake`; those of mirrors have the last one.
            receivers: If there are several, by node, the index of the one that accepts the node's messages.
        """
        if not self._profiles:
            self._crossing.begin()
        self._profiles, self._receiver_by_node = profiles, receivers
        for qos in self._own.keys() - {*profiles[:-1]}:
            self._own.pop(qos).destroy()
        for qos in profiles[:-1]:
            if qos not in self._own:
                self._own[qos] = self._subscription(self._node, qos)
        self._replays.follow(self._crossing, is_received=bool(profiles))

    def _replay_subscription(self) -> Subscription[Any]:
        def received(data: bytes, info: MessageInfo) -> None:
            self._crossing.replay(
                data, info.publisher_gid, info.publication_sequence_number, info.source_timestamp
            )

        return self._node.create_subscription(self._types.ours, self._topic, received, REPLAYS, raw=True)

    def _received(self, qos: QoSProfile, data: bytes, info: MessageInfo) -> None:
        if self._receiver_by_node:
            last = len(self._profiles) - 1
            if self._profiles[self._receiver_by_node.get(info.publisher_node, last)] != qos:
                return
        # All subscriptions of a topic receive the same messages in the same order; all but the first of each
        # are recognised by their numbers, and dropped.
        self._crossing.receive(
            data, info.publisher_gid, info.publication_sequence_number, info.source_timestamp,
            info.publisher_node,
        )  # fmt: skip

    def close(self) -> None:
        """Hide everything, and receive nothing."""
        for mirror in (*self._publishers, *self._subscriptions):
            self.remove(mirror)
        for publisher in tuple(self._leaving):
            publisher.destroy()
        self.set_intake((), {})


class _Replays:
    """A second subscription for a while, by which latched messages arrive again.

    Args:
        subscribe: Makes the subscription.
    """

    def __init__(self, subscribe: Callable[[], RosSubscription | Subscription[Any]]) -> None:
        self._subscribe = subscribe
        self._subscription: RosSubscription | Subscription[Any] | None = None
        self._timer: asyncio.TimerHandle | None = None

    def follow(self, crossing: Crossing, *, is_received: bool) -> None:
        """Begin if a topic wants it, and end if nobody receives the topic any more.

        Args:
            crossing: The topic.
            is_received: Whether its messages are received; otherwise a later subscription gets all that is
                latched.

        Raises:
            RosError: ROS 2 refuses the subscription.
        """
        wanted = crossing.wants_replay
        if wanted or not is_received:
            self._end()
        if wanted and is_received:
            self._subscription = self._subscribe()
            self._timer = asyncio.get_running_loop().call_later(REPLAY_SEC, self._end)
        crossing.wants_replay = False

    def _end(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._subscription is not None:
            self._subscription.destroy()
        self._timer = self._subscription = None


def _stamp_of(info: RosMessageInfo) -> int:
    """Return when a message was published: another program of DDS may write without a time, or with any."""
    return info.source_ns if info.source_ns >= 0 else max(info.received_ns, 0)
