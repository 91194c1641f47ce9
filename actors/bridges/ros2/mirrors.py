"""The mirrors that a bridge shows on both sides, and what crosses through them: what a plan says, done."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.graph import BRIDGE_APART, ORIGIN_LABEL
from actors.bridges.qos import is_latched
from actors.bridges.ros2.conversion import converter
from actors.bridges.ros2.errors import RosError, UnknownTypeError
from actors.bridges.ros2.inbound_calls import InboundCalls
from actors.bridges.ros2.outbound_calls import OutboundCalls
from actors.bridges.ros2.topics import TopicFromCallboard, TopicFromRos
from actors.bridges.rules import GLOBAL_TOPICS
from actors.qos.profile import QoSProfile
from proto.wire.codes import EntryKind
from proto.wire.names import split_node_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.counters import Counters
    from actors.bridges.graph import SideGraph
    from actors.bridges.plan import Mirror, Plan, SidePlan, Topic
    from actors.bridges.ros2.observer import Observer
    from actors.bridges.ros2.participant import Participant, RosNode
    from actors.bridges.ros2.types import Types
    from actors.bridges.rules import Rules
    from actors.node.bare_node import BareNode
    from actors.node.node import Node

STEPS: Final = 10
"""Nodes and endpoints shown or hidden before messages have their turn: some milliseconds."""


class Mirrors:
    """The mirrors on both sides.

    Args:
        node: The bridge's node in callboard.
        participant: The bridge's participant in ROS 2.
        origin: The label of mirrors in callboard, such as "ros2/7".
        observer: Knows ROS 2's graph.
        types: Finds the types of both sides.
        rules: The names of topics and nodes on the other side.
        counters: Counts what crosses.
        warn: Logs a warning, at a limited rate for each kind; gets the kind and the line.
    """

    def __init__(
        self,
        node: Node,
        participant: Participant,
        *,
        origin: str,
        observer: Observer,
        types: Types,
        rules: Rules,
        counters: Counters,
        warn: Callable[[str, str], None],
    ) -> None:
        self._observer = observer
        self._types = types
        self._rules = rules
        self._counters = counters
        self._warn = warn
        self._control = participant.control
        self._here = _CallboardSide(node, origin)
        self._there = _RosSide(participant)
        self._own_node = node.create_bare_node(
            f"_{node.get_name()}_calls", labels={ORIGIN_LABEL: origin}, apart=BRIDGE_APART
        )
        """For endpoints in callboard that are no mirrors: clients, and further subscriptions."""
        self._from_ros: dict[Topic, TopicFromRos] = {}
        self._from_callboard: dict[Topic, TopicFromCallboard] = {}
        outward, inward = (partial(counters.service, from_theirs=each) for each in (False, True))
        self._outbound = OutboundCalls(
            self._control, types, outward, self._from_ros.get, observer.request_hash
        )
        self._inbound = InboundCalls(self._own_node, types, inward, warn, self._from_callboard.get)
        self._is_complete = True
        """Whether no side has refused anything of the last plan."""

    async def apply(self, wanted: Plan) -> bool:
        """Hide what a plan has no longer, show what is new in it, and receive what it wants.

        Args:
            wanted: The plan.

        Returns:
            False if a side has refused something, which may work later with the same plan.
        """
        self._is_complete = True
        pace = _Pace()
        sides = (self._here, wanted.ours), (self._there, wanted.theirs)
        for side, of_side in sides:
            await self._hide_surplus(side, of_side, pace)
        for side, of_side in sides:
            await self._show_missing(side, of_side, pace)
        self._receive(wanted)
        return self._is_complete

    @property
    def has_lost_names(self) -> bool:
        """Whether the broker refuses a node because another one has its name."""
        return bool(self._here.lost)

    def find_publishers(self, is_here: Callable[[str], bool], ours: SideGraph, theirs: SideGraph) -> None:
        """Pass on messages whose publishers the graphs did not show when they arrived, or show no longer.

        Those of publishers that the last plan knew, and that have no mirror now, are dropped.

        Args:
            is_here: Returns whether callboard's graph has a native node of a name.
            ours: Callboard's graph as the last plan knew it.
            theirs: The graph of ROS 2 as the last plan knew it.
        """
        for received in self._from_ros.values():
            received.look_again()
            received.drop_refused(partial(_is_publisher, theirs))
        for passed_on in self._from_callboard.values():
            passed_on.drop_refused(partial(_is_publisher, ours))
            passed_on.publish_for_departed(is_here)

    def close(self) -> None:
        """Let nothing cross, and hide everything in callboard; the participant hides the nodes in ROS 2."""
        self._outbound.close()
        self._inbound.close()
        for topics in (self._topics(from_ros=True), self._topics(from_ros=False)):
            for topic in topics.values():
                topic.close()
        self._here.close()
        self._own_node.destroy()

    def document(self) -> dict[str, Any]:
        """Return what is shown where, and what the broker refuses, as a JSON object."""
        here, there = self._here, self._there
        nodes = {name: node.refusal for name, node in here.nodes.items() if node.refusal}
        endpoints = {mirror: each.refusal for mirror, each in here.shown.items() if each.refusal}
        # Endpoints of a refused node have the same reason.
        others = {f"{mirror.name}: {text}" for mirror, text in endpoints.items() if mirror.node not in nodes}
        return {
            "shown": {
                "callboard": {
                    "nodes": len(here.nodes) - len(nodes),
                    "endpoints": len(here.shown) - len(endpoints),
                },
                "ros2": {"nodes": len(there.nodes), "endpoints": len(there.shown)},
            },
            "refused_by_broker": sorted(others | {f"{name}: {text}" for name, text in nodes.items()}),
        }

    async def _hide_surplus(self, side: _Side, wanted: SidePlan, pace: _Pace) -> None:
        surplus, missing = side.shown.keys() - wanted.mirrors, wanted.mirrors - side.shown.keys()
        if lost := side.lost:
            again = {each for each in side.shown if each.node in lost}
            surplus, missing = surplus | again, missing | again & wanted.mirrors
            self._is_complete = False  # unless the next attempt finds that they have their names
        successors = {_original_of(each) for each in missing if _keeps(each)}
        for mirror in surplus:
            self._hide(side, mirror, is_replaced=_keeps(mirror) and _original_of(mirror) in successors)
            await pace.step()
        for node in (side.nodes.keys() - wanted.nodes.keys()) | lost:
            side.remove(node)
            await pace.step()

    async def _show_missing(self, side: _Side, wanted: SidePlan, pace: _Pace) -> None:
        for node in sorted(wanted.nodes.keys() - side.nodes.keys()):
            self._attempt(side.show, node)
            await pace.step()
        for mirror in sorted(wanted.mirrors - side.shown.keys(), key=_order):
            if mirror.node in side.nodes:
                self._attempt(self._show, side, mirror)
            await pace.step()

    def _attempt(self, function: Callable[..., None], *arguments: Any) -> None:
        """Do what ROS 2 may refuse, which concerns one name and no other."""
        try:
            function(*arguments)
        except (RosError, UnknownTypeError) as error:
            self._is_complete = False
            if self._counters.failed(str(error)):
                self._warn("what a side refuses; 'callboard bridge info' shows all", str(error))

    def _show(self, side: _Side, mirror: Mirror) -> None:
        """Show an endpoint."""
        here = side is self._here
        node = side.nodes[mirror.node]
        handle: Any
        called = ""
        if mirror.kind is EntryKind.CLIENT:
            types = self._types.service(mirror.type_name)
            if here:
                handle = node.create_client(types.ours, mirror.name)
            else:
                # It is only seen: it keeps no more of the responses to others than it must.
                handle = node.create_client(types.theirs, mirror.name, qos=QoSProfile(depth=1))
                called = mirror.name
        elif mirror.kind is EntryKind.SERVICE:
            handle = (self._outbound if here else self._inbound).show(mirror, node)
            if here and any(
                each.kind is EntryKind.CLIENT and each.name == mirror.source for each in self._there.shown
            ):
                called = mirror.source
        elif mirror.kind is EntryKind.PUBLISHER:
            handle = self._topic(mirror, from_ros=here).add_publisher(mirror, node)
        else:
            handle = self._topic(mirror, from_ros=not here).add_subscription(mirror, node)
        side.shown[mirror] = handle
        if called:  # not before: it may be refused, and what is shown would never be hidden
            self._outbound.prepare(called)

    def _hide(self, side: _Side, mirror: Mirror, *, is_replaced: bool) -> None:
        """Hide an endpoint."""
        here, handle = side is self._here, side.shown.pop(mirror)
        if mirror.kind is EntryKind.CLIENT:
            handle.destroy()
        elif mirror.kind is EntryKind.SERVICE:
            (self._outbound if here else self._inbound).hide(mirror)
        else:
            from_ros = here is (mirror.kind is EntryKind.PUBLISHER)
            topic = self._topics(from_ros=from_ros)[_topic_of(mirror)]
            if seconds := topic.remove(mirror, is_replaced=is_replaced):
                side.lingering[mirror.node] = seconds

    def _topics(self, *, from_ros: bool) -> dict[Topic, Any]:
        return self._from_ros if from_ros else self._from_callboard

    def _topic(self, mirror: Mirror, *, from_ros: bool) -> Any:
        """Return what receives a topic on the side where its messages come from."""
        topics, key = self._topics(from_ros=from_ros), _topic_of(mirror)
        if key not in topics:
            types, name = self._types.message(mirror.type_name), key[0]
            counts = self._counters.topic(name, mirror.type_name, from_theirs=from_ros)
            control = self._control
            convert = converter(types, name, self._rules.prefix, from_ros=from_ros)
            topics[key] = (
                TopicFromRos(name, types, self._observer, control, counts, convert=convert)
                if from_ros
                else TopicFromCallboard(
                    name,
                    types,
                    self._own_node,
                    control,
                    counts,
                    theirs=self._rules.name_there(name) or name,
                    convert=convert,
                )
            )
        return topics[key]

    def _receive(self, wanted: Plan) -> None:
        """Receive what the plan wants; latched messages that have arrived need not arrive again."""
        for key, topic in self._from_ros.items():
            profiles = wanted.theirs.intake.get(key, ())
            if not profiles and topic.is_received:
                profiles = wanted.theirs.latched.get(key, ())
            self._attempt(topic.set_intake, profiles)
        receivers: dict[str, dict[str, int]] = {}
        for (name, node), index in wanted.ours.receivers.items():
            receivers.setdefault(name, {})[node] = index
        for key, here in self._from_callboard.items():
            here.set_intake(wanted.ours.intake.get(key, ()), receivers.get(key[0], {}))
        for topics in (self._topics(from_ros=True), self._topics(from_ros=False)):
            for key in [key for key, topic in topics.items() if topic.is_idle]:
                del topics[key]


class _Side:
    """What is shown on one side.

    Attributes:
        nodes: The mirrors of nodes, by full name.
        shown: The mirrors of endpoints, with the endpoints.
        lingering: By node, in how many seconds it can be destroyed, as its last messages are on their way.
    """

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}
        self.shown: dict[Mirror, Any] = {}
        self.lingering: dict[str, float] = {}
        self._leaving: dict[str, tuple[Any, asyncio.TimerHandle]] = {}

    @property
    def lost(self) -> set[str]:
        """The nodes that are not shown because others have their names, and must be made again."""
        return set()

    def show(self, name: str) -> None:
        """Show a node; the one that has not been destroyed yet, if there is one.

        ROS 2 would give endpoints of a second node to the first one of the name in the process, and forget
        them with it.
        """
        if name in self._leaving:
            self.nodes[name], timer = self._leaving.pop(name)
            timer.cancel()
        else:
            self.nodes[name] = self.make(name)

    def remove(self, name: str) -> None:
        """Hide a node, and destroy it once it can be."""
        node, seconds = self.nodes.pop(name), self.lingering.pop(name, 0.0)
        if seconds:
            timer = asyncio.get_running_loop().call_later(seconds, self._leave, name)
            self._leaving[name] = node, timer
        else:
            node.destroy()

    def _leave(self, name: str) -> None:
        self._leaving.pop(name)[0].destroy()

    def make(self, name: str) -> Any:
        """Return a new node."""
        raise NotImplementedError


class _CallboardSide(_Side):
    """What is shown in callboard."""

    def __init__(self, owner: Node, origin: str) -> None:
        super().__init__()
        self._owner, self._labels = owner, {ORIGIN_LABEL: origin}

    @property
    def lost(self) -> set[str]:
        """The nodes that are not shown because others have their names, and must be made again."""
        return {name for name, node in self.nodes.items() if node.name_taken}

    def make(self, name: str) -> BareNode:
        """Return a new node."""
        namespace, base = split_node_name(name)
        return self._owner.create_bare_node(
            base,
            namespace=namespace,
            labels=self._labels,
            apart=BRIDGE_APART,
            shared_name=True,
            yields_name=True,
        )

    def close(self) -> None:
        """Hide everything."""
        for node in self.nodes.values():
            node.destroy()


class _RosSide(_Side):
    """What is shown in ROS 2."""

    def __init__(self, participant: Participant) -> None:
        super().__init__()
        self._participant = participant

    def make(self, name: str) -> RosNode:
        """Return a new node."""
        return self._participant.mirror_node(name)


class _Pace:
    """Lets messages have their turn after every few nodes and endpoints."""

    def __init__(self) -> None:
        self._steps = 0

    async def step(self) -> None:
        """Note that one was shown or hidden."""
        self._steps += 1
        if self._steps % STEPS == 0:
            await asyncio.sleep(0)


def _topic_of(mirror: Mirror) -> Topic:
    """Return the name and type of a mirror's topic on the side where its messages come from."""
    is_source = mirror.kind is EntryKind.PUBLISHER
    return (mirror.source if is_source else mirror.name), mirror.type_name


def _is_publisher(graph: SideGraph, node: str, topic: str) -> bool:
    """Return whether a graph has a node as a publisher of a topic."""
    kind = EntryKind.PUBLISHER
    return any((each.node, each.name, each.kind) == (node, topic, kind) for each in graph.endpoints)


def _keeps(mirror: Mirror) -> bool:
    """Return whether a mirror is a publisher that keeps messages for late joiners."""
    # A line of a log that was read is not read again.
    is_publisher = mirror.kind is EntryKind.PUBLISHER and mirror.source not in GLOBAL_TOPICS
    return is_publisher and mirror.qos is not None and is_latched(mirror.qos)


def _original_of(mirror: Mirror) -> tuple[str, str, str]:
    """Return what mirrors of one publisher have in common."""
    return mirror.source_node, mirror.source, mirror.type_name


def _order(mirror: Mirror) -> tuple[bool, str, str]:
    """Put publishers behind all others, so that nothing is published before it can be passed on."""
    return mirror.kind is EntryKind.PUBLISHER, mirror.node, mirror.name
