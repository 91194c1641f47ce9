"""ROS 2's graph as a bridge sees it, without a thread and nearly without cost while nothing changes.

Discovery sets off a guard condition of the context, which rclpy does not offer. `poll` asks it, without
waiting, and reads the graph only after a change: names of nodes, endpoints node by node, and what only a
topic's endpoint infos tell (QoS, hashes, gids) where those lists have changed. The infos of all other topics
follow within a few seconds, a slice at a time: a publisher that was made again leaves no trace in the lists.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

from actors.bridges.graph import SideEndpoint, SideGraph, SideNode
from actors.bridges.ros2.endpoints import ros_errors
from actors.bridges.ros2.participant import CONTROL_NODE, ENCLAVE, GID_PREFIX_SIZE, request_topic
from actors.bridges.ros2.qos import from_ros
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.bridges.ros2.importing import Ros
    from actors.bridges.ros2.participant import Participant
    from actors.qos.profile import QoSProfile

READ_INTERVAL_SEC: Final = 0.1
"""Shortest time between two readings of the graph: a program that publishes one message lives no longer."""
READ_INTERVAL_PER_NODE_SEC: Final = 0.002
"""The same for each node, whose lists take 80 us: a graph that changes all the time takes 4 % of a core."""
RESCAN_SEC: Final = 30.0
"""Longest time between two readings of everything: no change should be missed, but the middleware decides."""
INFOS_PER_POLL: Final = 200
"""Queries of endpoint infos in one poll, of some 60 us each, while lists have changed: a robot of 300 topics
is read in three polls, and messages have their turn in between."""
QUIET_INFOS_PER_POLL: Final = 40
"""The same for topics whose lists are as before."""

_CALLS: Final = frozenset({EntryKind.SERVICE, EntryKind.CLIENT})


_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


class _Row(NamedTuple):
    """An entry of a node's lists."""

    node: str
    kind: EntryKind
    name: str
    type_name: str


class Observer:
    """ROS 2's graph.

    Args:
        ros: ROS 2.
        participant: The bridge's participant.
    """

    def __init__(self, ros: Ros, participant: Participant) -> None:
        self._ros = ros
        self._node: Any = participant.control.rclpy_node
        self._own_id = participant.bridge_id
        self._is_own = participant.is_own
        self._change = _GraphChange(ros, participant)
        self._is_stale = True
        self._read_at = float("-inf")
        self._bridge_prefixes: set[bytes] = set()
        self._nodes: frozenset[SideNode] = frozenset()
        self._ambiguous: frozenset[str] = frozenset()
        """Native nodes whose name another node has: the lists by node do not tell them apart."""
        self._rows: frozenset[_Row] = frozenset()
        """What the lists by node say."""
        self._found_rows: dict[tuple[EntryKind, str], frozenset[_Row]] = {}
        """By kind and name, services and clients of ambiguous nodes, from endpoint infos."""
        self._topics: dict[tuple[EntryKind, str], tuple[SideEndpoint, ...]] = {}
        self._publishers: dict[str, dict[bytes, tuple[str, QoSProfile]]] = {}
        """By topic, the node and the offer of each publisher."""
        self._urgent: set[tuple[EntryKind, str]] = set()
        """Topics whose infos are to be read first, since the lists have changed there."""
        self._rotation: list[tuple[EntryKind, str]] = []
        """Topics and services whose infos are still to be read in this round."""
        self._rotates_again = False
        self._looked_up: set[str] = set()
        self._has_changed = False
        """Whether the graph must be composed again."""
        self._graph = SideGraph(frozenset(), frozenset())

    def poll(self, now: float) -> SideGraph:
        """Return the graph; call it some ten times per second.

        Args:
            now: A monotonic time in seconds.

        Returns:
            The graph; the same object as before if nothing has changed.

        Raises:
            RosError: ROS 2 has been shut down.
        """
        with ros_errors(self._ros, "ROS 2's graph cannot be read"):
            return self._poll(now)

    def _poll(self, now: float) -> SideGraph:
        self._looked_up.clear()
        if self._change.seen() or now - self._read_at >= RESCAN_SEC:
            self._is_stale = True
        interval = max(READ_INTERVAL_SEC, len(self._nodes) * READ_INTERVAL_PER_NODE_SEC)
        if self._is_stale and now - self._read_at >= interval:
            self._is_stale = False
            self._read_at = now
            self._rotates_again = True
            self._read()
        if self._urgent:
            for _ in range(min(INFOS_PER_POLL, len(self._urgent))):
                self._read_topic(self._urgent.pop())
        elif self._rotation or self._rotates_again:
            self._rotate()
        if self._has_changed:
            self._has_changed = False
            graph = self._compose()
            if graph != self._graph:
                self._graph = graph
        return self._graph

    def node_of(self, topic: str, gid: bytes) -> str | None:
        """Return the full name of the native node that has a publisher.

        Args:
            topic: The full name of the topic.
            gid: The publisher, as a message names it.

        Returns:
            None if a bridge shows it; "" if ROS 2 does not know the publisher (yet).
        """
        if self._is_bridge(gid):
            return None
        found = self._publishers.get(topic, {}).get(gid)
        if found is None and topic not in self._looked_up:
            self._looked_up.add(topic)  # once per poll, whatever unknown publishers send
            self._read_topic((EntryKind.PUBLISHER, topic))
            found = self._publishers.get(topic, {}).get(gid)
        return found[0] if found else ""

    def offer_of(self, topic: str, gid: bytes) -> QoSProfile | None:
        """Return what a publisher offers; None if ROS 2 does not know it (yet).

        Args:
            topic: The full name of the topic.
            gid: The publisher, as a message names it.
        """
        found = self._publishers.get(topic, {}).get(gid)
        return found[1] if found else None

    def request_hash(self, service: str) -> str:
        """Return the RIHS01 hash of the requests that the native servers of a service take.

        ROS 2 shows no other hash of a service. With several servers, it is one of theirs.

        Args:
            service: The full name of the service.

        Returns:
            "" if there is no server, or it does not tell.
        """
        infos = self._infos(EntryKind.SUBSCRIPTION, request_topic(service), no_mangle=True)
        return next((found for _, _, info in infos if (found := _type_hash(info))), "")

    def _is_bridge(self, gid: bytes) -> bool:
        return self._is_own(gid) or gid[:GID_PREFIX_SIZE] in self._bridge_prefixes

    def _read(self) -> None:
        """Read the lists, and note where they have changed."""
        nodes, counts = set[SideNode](), Counter[str]()
        for base, namespace, enclave in self._node.get_node_names_and_namespaces_with_enclaves():
            origin = enclave.removeprefix(ENCLAVE) if enclave.startswith(ENCLAVE) else ""
            nodes.add(SideNode(_full_name(namespace, base), origin))
            counts[_full_name(namespace, base)] += 1
        self._read_bridges(nodes)
        natives = {node.name for node in nodes if not node.origin}
        rows = frozenset(row for name in natives for row in self._rows_of(name))
        ambiguous = frozenset(name for name in natives if counts[name] > 1)
        for row in self._rows:
            if row.node in ambiguous - self._ambiguous and row.kind in _CALLS:
                # Until its services have been read one by one, the node has those that it had.
                key = (row.kind, row.name)
                self._found_rows[key] = self._found_rows.get(key, frozenset()) | {row}
        self._ambiguous = ambiguous
        self._urgent |= {(row.kind, row.name) for row in rows ^ self._rows if row.kind not in _CALLS}
        before, self._nodes = self._nodes, frozenset(nodes)
        self._has_changed |= self._nodes != before or rows != self._rows
        self._rows = rows

    def _read_bridges(self, nodes: Iterable[SideNode]) -> None:
        """Learn the participants of other bridges, by their control nodes."""
        names = {CONTROL_NODE + node.origin for node in nodes} - {CONTROL_NODE, CONTROL_NODE + self._own_id}
        self._bridge_prefixes = {
            bytes(info.endpoint_gid)[:GID_PREFIX_SIZE]
            for info in (self._node.get_publishers_info_by_topic("/parameter_events") if names else ())
            if info.node_name in names
        }

    def _rows_of(self, node: str) -> Iterator[_Row]:
        namespace, _, base = node.rpartition("/")
        kinds = {
            EntryKind.PUBLISHER: self._node.get_publisher_names_and_types_by_node,
            EntryKind.SUBSCRIPTION: self._node.get_subscriber_names_and_types_by_node,
            EntryKind.SERVICE: self._node.get_service_names_and_types_by_node,
            EntryKind.CLIENT: self._node.get_client_names_and_types_by_node,
        }
        try:
            for kind, read in kinds.items():
                for name, types in read(base, namespace or "/"):
                    for type_name in types:
                        yield _Row(node, kind, name, type_name)
        except self._ros.implementation.NodeNameNonExistentError:
            return  # it has gone since its name was read

    def _rotate(self) -> None:
        """Read the infos of some topics and services that nothing says have changed."""
        if not self._rotation:
            self._rotates_again = False
            self._rotation = list(self._everything())
        for _ in range(min(QUIET_INFOS_PER_POLL, len(self._rotation))):
            key = self._rotation.pop()
            if key[0] in _CALLS:
                self._read_service(key)
            else:
                self._read_topic(key)

    def _everything(self) -> Iterator[tuple[EntryKind, str]]:
        """Yield all topics; with nodes of one name, also all services."""
        names = {name for name, _ in self._node.get_topic_names_and_types()}
        known = {name for _, name in self._topics}
        for name in names | known:
            yield EntryKind.PUBLISHER, name
            yield EntryKind.SUBSCRIPTION, name
        services = {name for _, name in self._found_rows}
        if self._ambiguous:
            services |= {name for name, _ in self._node.get_service_names_and_types()}
        for name in services:
            yield EntryKind.SERVICE, name
            yield EntryKind.CLIENT, name

    def _read_topic(self, key: tuple[EntryKind, str]) -> None:
        """Read the infos of a topic's publishers or subscriptions."""
        kind, topic = key
        endpoints: list[SideEndpoint] = []
        found: dict[bytes, tuple[str, QoSProfile]] = {}
        for node, gid, info in self._infos(kind, topic):
            qos = from_ros(info.qos_profile)
            endpoints.append(SideEndpoint(node, kind, topic, info.topic_type, _type_hash(info), qos))
            found[gid] = node, qos
        if kind is EntryKind.PUBLISHER:
            _put(self._publishers, topic, found)
        self._has_changed |= _put(self._topics, key, tuple(endpoints))

    def _read_service(self, key: tuple[EntryKind, str]) -> None:
        """Read which of the ambiguous nodes serve or call a service."""
        kind, name = key
        side = EntryKind.SUBSCRIPTION if kind is EntryKind.SERVICE else EntryKind.PUBLISHER
        rows = frozenset(
            _Row(node, kind, name, type_name)
            for node, _, info in self._infos(side, request_topic(name), no_mangle=True)
            if node in self._ambiguous and (type_name := _service_type(info.topic_type))
        )
        self._has_changed |= _put(self._found_rows, key, rows)

    def _infos(
        self, kind: EntryKind, topic: str, *, no_mangle: bool = False
    ) -> Iterator[tuple[str, bytes, Any]]:
        """Yield node, gid and info of each endpoint of a native node."""
        is_publisher = kind is EntryKind.PUBLISHER
        node = self._node
        read = node.get_publishers_info_by_topic if is_publisher else node.get_subscriptions_info_by_topic
        for info in read(topic, no_mangle=no_mangle):
            gid = bytes(info.endpoint_gid)
            if info.node_name.startswith("_NODE_NAME_UNKNOWN_") or self._is_bridge(gid):
                continue  # another program of DDS, or a node whose name is still on its way
            yield _full_name(info.node_namespace, info.node_name), gid, info

    def _compose(self) -> SideGraph:
        natives = {node.name for node in self._nodes if not node.origin}
        endpoints = {
            endpoint for found in self._topics.values() for endpoint in found if endpoint.node in natives
        }
        found = (row for rows in self._found_rows.values() for row in rows if row.node in self._ambiguous)
        listed = (row for row in self._rows if row.kind in _CALLS and row.node not in self._ambiguous)
        endpoints |= {SideEndpoint(*row) for row in (*found, *listed)}
        return SideGraph(self._nodes, frozenset(endpoints))


class _GraphChange:
    """The guard condition that discovery sets off."""

    def __init__(self, ros: Ros, participant: Participant) -> None:
        self._rcl = ros.rcl
        self._node = node = participant.control.rclpy_node.handle
        context = participant.context.handle
        with node:
            self._guard = ros.rcl.rcl_node_get_graph_guard_condition(node.pointer)
        with context:
            self._wait_set = ros.implementation.WaitSet(0, 1, 0, 0, 0, 0, context)

    def seen(self) -> bool:
        """Return whether the graph has changed since the last call."""
        wait_set = self._wait_set
        with self._node, wait_set:  # the condition is the node's
            wait_set.clear_entities()
            self._rcl.rcl_wait_set_add_guard_condition(wait_set.pointer, self._guard, None)
            wait_set.wait(0)
            return bool(wait_set.is_ready("guard_condition", 0))


def _full_name(namespace: str, base: str) -> str:
    return f"{'' if namespace == '/' else namespace}/{base}"


def _type_hash(info: Any) -> str:
    found = str(info.topic_type_hash)
    return found if found.startswith("RIHS") else ""  # "INVALID" otherwise


def _service_type(dds_type: str) -> str:
    """Return the type of a service: std_srvs::srv::dds_::SetBool_Request_ is std_srvs/srv/SetBool.

    Another program of DDS may have any type; "" then.
    """
    match dds_type.split("::"):
        case [package, kind, "dds_", name]:
            return f"{package}/{kind}/{name.removesuffix('_Request_')}"
        case _:
            return ""


def _put(found: dict[_Key, _Value], key: _Key, value: _Value) -> bool:
    """Set what was found, without a trace if there is nothing, and return whether that is a change."""
    if (value or None) == found.get(key):
        return False
    if value:
        found[key] = value
    else:
        del found[key]
    return True
