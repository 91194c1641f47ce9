"""What each side of a bridge shows of the other one: a pure function of both graphs and the rules.

    wanted = plan(ours, theirs, rules, known)
    wanted.ours.mirrors    # endpoints to show in callboard
    wanted.theirs.intake   # topics of the other network to subscribe to, and with which QoS

Only native nodes have mirrors: a mirror is never mirrored, whoever made it. So nothing crosses twice or comes
back, however bridges are connected. Mirrors exist as long as their originals, so presence and demand are in
the graphs: a topic is received where it has publishers exactly while the other side has subscriptions.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bridges.candidates import find_candidates
from actors.bridges.node_names import names_here, names_there
from actors.bridges.qos import (
    common_offer,
    intake_profiles,
    is_latched,
    merged_offer,
    mirror_offer,
    mirror_request,
    receiver_of,
)
from actors.bridges.report import Reason, Refusals
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.candidates import Candidate, KnownType
    from actors.bridges.graph import SideEndpoint, SideGraph
    from actors.bridges.report import Refusal
    from actors.bridges.rules import Rules
    from actors.qos.profile import QoSProfile

Topic = tuple[str, str]
"""The full name of a topic on its side, and its type."""


class Mirror(NamedTuple):
    """One endpoint to show.

    Attributes:
        node: The full name of the mirror node.
        kind: PUBLISHER, SUBSCRIPTION, SERVICE or CLIENT, like the original.
        name: The full name of the topic or service on the side where the mirror is shown.
        type_name: Its type.
        qos: What it offers or requests; None for services. For a subscription it is the last profile of its
            topic's intake, if there is one.
        source: The name of the topic or service on the original's side.
        source_node: The full name of the original's node.
    """

    node: str
    kind: EntryKind
    name: str
    type_name: str
    qos: QoSProfile | None
    source: str
    source_node: str


class SidePlan(NamedTuple):
    """What to show and to receive on one side.

    Attributes:
        nodes: The full names of mirror nodes, with those of their originals.
        mirrors: Their endpoints: one for each node, kind, name and type.
        intake: The topics of this side to receive, each with the QoS of the subscriptions that it needs. Only
            messages of native nodes that have a mirror on the other side cross.
        latched: Topics that nobody needs now, but whose latched messages have been received already if they
            were in the intake before: a subscription that exists may stay, so that they do not arrive twice.
        receivers: For topics with more than one subscription: by the names of the topic and of a publishing
            node, the index of the subscription whose messages of that node are accepted. The others are
            received twice, and dropped.
    """

    nodes: dict[str, str]
    mirrors: frozenset[Mirror]
    intake: dict[Topic, tuple[QoSProfile, ...]]
    latched: dict[Topic, tuple[QoSProfile, ...]]
    receivers: dict[tuple[str, str], int]


class Plan(NamedTuple):
    """What a bridge does.

    Attributes:
        ours: What to show and to receive in callboard.
        theirs: The same in the other network.
        refusals: What does not cross, and why; sorted.
    """

    ours: SidePlan
    theirs: SidePlan
    refusals: tuple[Refusal, ...]


_EMPTY_SIDE: Final = SidePlan({}, frozenset(), {}, {}, {})
EMPTY_PLAN: Final = Plan(_EMPTY_SIDE, _EMPTY_SIDE, ())
"""The plan of a bridge that shows nothing, such as one that waits for another one to end."""


def plan(
    ours: SideGraph,
    theirs: SideGraph,
    rules: Rules,
    known: Callable[[str], KnownType],
    before: Plan = EMPTY_PLAN,
) -> Plan:
    """Return what each side shows of the other one.

    Args:
        ours: Callboard's graph.
        theirs: The graph of the other network.
        rules: What may cross, and under which names.
        known: Returns what is known of a type, by its name.
        before: The plan before, from which mirror nodes keep their names (see `names_here`).

    Returns:
        The plan; equal graphs after equal plans give equal plans.
    """
    refusals = Refusals()
    candidates, hidden = find_candidates(ours, theirs, rules, known, refusals)
    their_natives = theirs.native_names()
    our_names = names_here(their_natives - hidden, ours.nodes, rules, before.ours.nodes, refusals)
    crossing = {each.node for candidate in candidates for each in candidate.ours}
    their_names = names_there(crossing, their_natives, rules, refusals)
    # Nothing crosses of a node that is not shown.
    for candidate in candidates if len(our_names) < len(their_natives) else ():
        candidate.theirs = [each for each in candidate.theirs if each.node in our_names]
    for candidate in candidates if len(their_names) < len(crossing) else ():
        candidate.ours = [each for each in candidate.ours if each.node in their_names]
    here, there = _Side(our_names), _Side(their_names)
    _show_within_limit(candidates, here, there, rules.max_endpoints, refusals)
    return Plan(here.plan(), there.plan(), refusals.all())


def _show_within_limit(
    candidates: list[Candidate], here: _Side, there: _Side, max_endpoints: int, refusals: Refusals
) -> None:
    """Show candidates on both sides, as long as they fit."""
    # If not all fit, the same ones each time.
    if sum(len(each.ours) + len(each.theirs) for each in candidates) > max_endpoints:
        candidates.sort(key=lambda each: (each.their_name, each.is_service))
    surplus: list[Candidate] = []
    for each in candidates:
        if here.size + len(each.theirs) > max_endpoints or there.size + len(each.ours) > max_endpoints:
            surplus.append(each)
            continue
        here.show(each, each.our_name, each.ours, each.their_name, each.theirs)
        there.show(each, each.their_name, each.theirs, each.our_name, each.ours)
    if surplus:
        text = f"{len(surplus)} topics and services are beyond max_endpoints = {max_endpoints}: allow fewer"
        refusals.add(surplus[0].name, Reason.LIMIT, text)


class _Side:
    """Collects what one side shows and receives."""

    def __init__(self, names: dict[str, str]) -> None:
        self._names = names
        self._mirrors: list[Mirror] = []
        self._intake: dict[Topic, tuple[QoSProfile, ...]] = {}
        self._latched: dict[Topic, tuple[QoSProfile, ...]] = {}
        self._receivers: dict[tuple[str, str], int] = {}

    @property
    def size(self) -> int:
        """The number of mirrors."""
        return len(self._mirrors)

    def show(
        self,
        candidate: Candidate,
        name: str,
        natives: list[SideEndpoint],
        source: str,
        originals: list[SideEndpoint],
    ) -> None:
        """Add a topic or service.

        Args:
            candidate: It.
            name: Its name on this side.
            natives: Its endpoints of this side.
            source: Its name on the other side.
            originals: Its endpoints of the other side, to be shown here.
        """
        if candidate.is_service:
            self._mirrors.extend(
                Mirror(self._names[node], kind, name, originals[0].type_name, None, source, node)
                for node, kind in {(each.node, each.kind) for each in originals}
            )
            return
        merged: dict[tuple[str, EntryKind], list[SideEndpoint]] = defaultdict(list)
        for each in originals:
            merged[each.node, each.kind].append(each)
        profiles = self._receive(candidate, name, natives, originals)
        for (node, kind), endpoints in merged.items():
            if kind is EntryKind.PUBLISHER:
                offers = [
                    mirror_offer(candidate.their_name, _qos(each), candidate.depth) for each in endpoints
                ]
                qos = merged_offer(offers)
            else:
                qos = profiles[-1] if profiles else mirror_request(_qos(endpoints[0]))
            type_name = endpoints[0].type_name
            self._mirrors.append(Mirror(self._names[node], kind, name, type_name, qos, source, node))

    def _receive(
        self, candidate: Candidate, name: str, natives: list[SideEndpoint], originals: list[SideEndpoint]
    ) -> tuple[QoSProfile, ...] | None:
        """Add a topic to the intake if it has publishers here and subscriptions there."""
        publishers: dict[str, list[QoSProfile]] = defaultdict(list)
        for each in natives:
            if each.kind is EntryKind.PUBLISHER:
                publishers[each.node].append(_qos(each))
        offers = {node: common_offer(each) for node, each in publishers.items()}
        demanded = any(each.kind is EntryKind.SUBSCRIPTION for each in originals)
        if not offers or not (demanded or any(map(is_latched, offers.values()))):
            return None
        profiles = intake_profiles(candidate.their_name, offers.values(), candidate.depth)
        (self._intake if demanded else self._latched)[name, natives[0].type_name] = profiles
        if len(profiles) > 1:
            self._receivers.update(
                ((name, node), receiver_of(profiles, each)) for node, each in offers.items()
            )
        return profiles if demanded else None

    def plan(self) -> SidePlan:
        nodes = {name: original for original, name in self._names.items()}
        return SidePlan(nodes, frozenset(self._mirrors), self._intake, self._latched, self._receivers)


def _qos(endpoint: SideEndpoint) -> QoSProfile:
    assert endpoint.qos is not None, f"{endpoint.name} is a topic"
    return endpoint.qos
