"""What one side of a bridge shows: its nodes and their endpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from actors.qos.profile import QoSProfile
    from proto.wire.codes import EntryKind


class SideEndpoint(NamedTuple):
    """An endpoint of a native node.

    Attributes:
        node: The full name of the node.
        kind: PUBLISHER, SUBSCRIPTION, SERVICE or CLIENT.
        name: The full name of the topic or service.
        type_name: Its type, such as "std_msgs/msg/String" or "pkg/action/Fibonacci_SendGoal".
        type_hash: The type's RIHS01 hash; "" is unknown.
        qos: Its QoS; None for services and clients.
    """

    node: str
    kind: EntryKind
    name: str
    type_name: str
    type_hash: str = ""
    qos: QoSProfile | None = None


class SideNode(NamedTuple):
    """A node.

    Attributes:
        name: Its full name.
        origin: Whose mirror it is; "" is a native node.
        shared: Whether other nodes may have its name.
    """

    name: str
    origin: str = ""
    shared: bool = True


class SideGraph(NamedTuple):
    """What a side shows.

    Attributes:
        nodes: All nodes.
        endpoints: The endpoints of native nodes.
    """

    nodes: frozenset[SideNode]
    endpoints: frozenset[SideEndpoint]
