"""Graphs of two sides, written shortly."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bridges.graph import SideEndpoint, SideGraph, SideNode
from actors.bridges.plan import EMPTY_PLAN, Plan, plan
from actors.bridges.rules import Rules
from actors.qos.profile import HistoryPolicy, QoSProfile
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.candidates import KnownType

PUBLISHER: Final = EntryKind.PUBLISHER
SUBSCRIPTION: Final = EntryKind.SUBSCRIPTION
SERVICE: Final = EntryKind.SERVICE
CLIENT: Final = EntryKind.CLIENT
STRING: Final = "std_msgs/msg/String"
BOOL: Final = "std_msgs/msg/Bool"
SET_BOOL: Final = "std_srvs/srv/SetBool"
VOLATILE: Final = QoSProfile(depth=10)
NOTHING: Final = SideGraph()
HIDDEN_HISTORY: Final = QoSProfile(history=HistoryPolicy.UNKNOWN, depth=0)
"""What another network shows of a default profile."""


def endpoint(
    node: str,
    kind: EntryKind,
    name: str,
    type_name: str = "",
    qos: QoSProfile = VOLATILE,
    type_hash: str = "",
) -> SideEndpoint:
    """Return an endpoint: of a String topic or a SetBool service, unless its type is given."""
    is_service = kind in {SERVICE, CLIENT}
    usual = SET_BOOL if is_service else STRING
    return SideEndpoint(node, kind, name, type_name or usual, type_hash, None if is_service else qos)


def side(*endpoints: SideEndpoint, nodes: tuple[SideNode | str, ...] = ()) -> SideGraph:
    """Return a graph with some endpoints and their nodes (shared unless given) and with further nodes."""
    given = [SideNode(each) if isinstance(each, str) else each for each in nodes]
    names = {each.name for each in given}
    owners = {SideNode(each.node) for each in endpoints if each.node not in names}
    return SideGraph(frozenset(owners | {*given}), frozenset(endpoints))


class Known(NamedTuple):
    """What a bridge knows of a type, as `KnownType`."""

    reason: str = ""
    our_hash: str = ""
    their_hash: str = ""

    def difference(self, endpoint_hash: str, /) -> str:
        """Compare the hash of an endpoint of the other network with callboard's."""
        same = not self.our_hash or endpoint_hash in {"", self.our_hash}
        return "" if same else f"{self.our_hash} is not {endpoint_hash}"


def all_known(_: str) -> Known:
    """Know each type on both sides."""
    return Known()


def planned(
    ours: SideGraph = NOTHING,
    theirs: SideGraph = NOTHING,
    known: Callable[[str], KnownType] = all_known,
    before: Plan = EMPTY_PLAN,
    **rules: object,
) -> Plan:
    """Return the plan for two sides, with some rules."""
    return plan(ours, theirs, Rules(**rules), known, before)  # type: ignore[arg-type]
