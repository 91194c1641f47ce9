"""Which topics and services could cross a bridge: what the rules allow, without what makes no sense.

A candidate is one topic or service with the endpoints of both sides. What cannot cross is removed from it and
refused, with the reason: a server on each side, a second clock, a name that the other side does not allow,
types that differ or that one side lacks.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from actors.bridges.report import Reason
from actors.bridges.rules import GLOBAL_TOPICS, action_of
from proto.errors import InvalidNameError
from proto.wire.codes import EntryKind
from proto.wire.names import validate_full_topic_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actors.bridges.graph import SideEndpoint, SideGraph
    from actors.bridges.report import Refusals
    from actors.bridges.rules import Rules

CALLBOARD_PACKAGES: Final = frozenset({"callboard_interfaces"})
"""Packages of types that exist in callboard only: nobody expects them elsewhere."""
CLOCK: Final = "/clock"


class KnownType(Protocol):
    """What a bridge knows of a type."""

    @property
    def reason(self) -> str:
        """Why it cannot cross, with the remedy; "" if it can."""
        ...

    @property
    def our_hash(self) -> str:
        """Its hash in callboard, "" if callboard lacks it."""
        ...

    @property
    def their_hash(self) -> str:
        """Its hash in the other network, "" if it is unknown."""
        ...

    def difference(self, endpoint_hash: str, /) -> str:
        """Return why an endpoint of the other network has another type of this name; "" if it has not.

        Args:
            endpoint_hash: The hash in the endpoint's information, "" if it is unknown.
        """
        ...


class Candidate:
    """One topic or service with its native endpoints on both sides.

    Args:
        our_name: Its full name in callboard.
        their_name: Its full name in the other network.
        is_service: Whether it is a service.
        depth: The depth that a rule sets for its mirrors; None for none.

    Attributes:
        our_name, their_name, is_service, depth: As given.
        ours: Its endpoints in callboard.
        theirs: Its endpoints in the other network.
    """

    __slots__ = ("depth", "is_service", "our_name", "ours", "their_name", "theirs")

    def __init__(self, our_name: str, their_name: str, depth: int | None, *, is_service: bool) -> None:
        self.our_name = our_name
        self.their_name = their_name
        self.depth = depth
        self.is_service = is_service
        self.ours: list[SideEndpoint] = []
        self.theirs: list[SideEndpoint] = []

    @property
    def name(self) -> str:
        """The name on the side where it is native; the other network's, if it is on both."""
        return self.their_name if self.theirs else self.our_name

    def types(self) -> set[str]:
        """Return the types that its endpoints have."""
        return {each.type_name for each in self.ours} | {each.type_name for each in self.theirs}

    def is_on_both_sides(self, kind: EntryKind) -> bool:
        """Return whether both sides have a native endpoint of a kind."""
        return any(each.kind is kind for each in self.ours) and any(each.kind is kind for each in self.theirs)


class Candidates(NamedTuple):
    """What could cross.

    Attributes:
        topics_and_services: Each has endpoints on one side at least.
        hidden_nodes: Nodes of the other network of which the rules hide everything.
    """

    topics_and_services: list[Candidate]
    hidden_nodes: set[str]


def find_candidates(
    ours: SideGraph,
    theirs: SideGraph,
    rules: Rules,
    known: Callable[[str], KnownType],
    refusals: Refusals,
) -> Candidates:
    """Return what could cross.

    Args:
        ours: Callboard's graph.
        theirs: The graph of the other network.
        rules: What may cross, and under which names.
        known: Returns what is known of a type, by its name.
        refusals: Gets what cannot cross.
    """
    found, restricted = _collect(ours, theirs, rules)
    found = _without_actions_served_twice(found, refusals)
    check = _Check(ours.native_names(), known, refusals)
    found = [each for each in found if check.leaves_something(each)]
    return Candidates(found, restricted - _nodes_there(found) if restricted else restricted)


def _collect(ours: SideGraph, theirs: SideGraph, rules: Rules) -> tuple[list[Candidate], set[str]]:
    """Sort the endpoints of native nodes by topic and service, without those that the rules hide.

    Returns:
        The candidates, and the nodes of the other network with an endpoint that the rules hide.
    """
    candidates: dict[tuple[str, bool], Candidate] = {}

    def candidate(our_name: str, their_name: str, kind: EntryKind) -> Candidate:
        is_service = kind is EntryKind.SERVICE or kind is EntryKind.CLIENT
        key = their_name, is_service
        found = candidates.get(key)
        if found is None:
            depth = None if is_service else rules.depth_of(their_name)
            found = candidates[key] = Candidate(our_name, their_name, depth, is_service=is_service)
        return found

    restricted = set[str]()
    for endpoint in _native_endpoints(ours):
        name = rules.name_there(endpoint.name)
        if name is not None and rules.crosses(name):
            candidate(endpoint.name, name, endpoint.kind).ours.append(endpoint)
    for endpoint in _native_endpoints(theirs):
        if rules.crosses(endpoint.name):
            candidate(rules.name_here(endpoint.name), endpoint.name, endpoint.kind).theirs.append(endpoint)
        else:
            restricted.add(endpoint.node)
    return list(candidates.values()), restricted


def _native_endpoints(graph: SideGraph) -> Iterator[SideEndpoint]:
    natives = graph.native_names()
    return (each for each in graph.endpoints if not each.origin and each.node in natives)


def _without_actions_served_twice(candidates: list[Candidate], refusals: Refusals) -> list[Candidate]:
    """Leave out the services and topics of actions that both sides serve."""
    served = {
        action
        for each in candidates
        if (action := action_of(each.their_name)) and each.is_on_both_sides(EntryKind.SERVICE)
    }
    for action in served:
        refusals.add(action, Reason.SERVED_TWICE, f"both sides have a server of the action {action}")
    return [each for each in candidates if action_of(each.their_name) not in served] if served else candidates


def _nodes_there(candidates: Iterable[Candidate]) -> set[str]:
    """Return the nodes of the other network that have more to cross than every node has."""
    return {
        endpoint.node
        for each in candidates
        if each.their_name not in GLOBAL_TOPICS
        for endpoint in each.theirs
    }


class _Check:
    """Removes from candidates what cannot cross, and refuses it."""

    def __init__(self, our_natives: set[str], known: Callable[[str], KnownType], refusals: Refusals) -> None:
        self._our_natives = our_natives
        self._known = known
        self._refuse = refusals.add

    def leaves_something(self, candidate: Candidate) -> bool:
        """Remove from a candidate what cannot cross; return whether something is left."""
        if candidate.is_service:
            if candidate.is_on_both_sides(EntryKind.SERVICE):
                # Both nodes have the name, which is reported; their parameter services are no news.
                quiet = candidate.our_name.rpartition("/")[0] in self._our_natives
                text = f"both sides have a server of {candidate.their_name}: each side keeps its own"
                self._refuse(candidate.their_name, Reason.SERVED_TWICE, text, quiet=quiet)
                return False
        elif candidate.their_name == CLOCK and not self._leave_one_clock(candidate):
            return False
        if not self._has_valid_names(candidate):
            return False
        self._leave_one_type(candidate)
        return bool(candidate.ours or candidate.theirs)

    def _leave_one_clock(self, candidate: Candidate) -> bool:
        """Leave one publisher of the time on its side; return False if both sides have one."""
        if candidate.is_on_both_sides(EntryKind.PUBLISHER):
            text = "both sides publish the time: each side keeps its own"
            self._refuse(candidate.name, Reason.SECOND_CLOCK, text)
            return False
        for endpoints in (candidate.ours, candidate.theirs):
            nodes = sorted({each.node for each in endpoints if each.kind is EntryKind.PUBLISHER})
            for node in nodes[1:]:
                text = f"{nodes[0]} publishes the time: the time of {node} does not cross"
                self._refuse(candidate.name, Reason.SECOND_CLOCK, text)
            if len(nodes) > 1:
                endpoints[:] = [each for each in endpoints if each.node not in nodes[1:]]
        return True

    def _has_valid_names(self, candidate: Candidate) -> bool:
        fault = _name_fault(candidate.our_name) or _name_fault(candidate.their_name)
        if fault:
            self._refuse(candidate.name, Reason.INVALID_NAME, fault)
        return not fault

    def _leave_one_type(self, candidate: Candidate) -> None:
        """Leave the endpoints of the one type that crosses."""
        # Subscriptions of callboard that accept every type get the one that crosses.
        untyped = [each for each in candidate.ours if not each.type_name]
        candidate.ours[:] = [each for each in candidate.ours if each.type_name]
        self._choose_type(candidate)
        for type_name in {each.type_name for each in candidate.theirs}:
            candidate.ours += [each._replace(type_name=type_name) for each in untyped]

    def _choose_type(self, candidate: Candidate) -> None:
        types = candidate.types()
        candidate.ours[:] = [each for each in candidate.ours if self._our_type_crosses(candidate, each)]
        candidate.theirs[:] = [each for each in candidate.theirs if self._their_type_crosses(candidate, each)]
        if len(types) == 1:
            return
        # A type that both sides have comes first: it may cross already. Then one of the other network: its
        # nodes decided what the topic carries.
        here = {each.type_name for each in candidate.ours}
        there = {each.type_name for each in candidate.theirs}
        usable = here & there or there or here
        if not usable:
            return
        chosen = min(usable)
        for other in sorted(candidate.types() - {chosen}):
            text = (
                f"{candidate.name} crosses as {chosen}, "
                "and a process of the other network has one type for it"
            )
            self._refuse(candidate.name, Reason.SECOND_TYPE, text, other)
        for endpoints in (candidate.ours, candidate.theirs):
            endpoints[:] = [each for each in endpoints if each.type_name == chosen]

    def _our_type_crosses(self, candidate: Candidate, endpoint: SideEndpoint) -> bool:
        """Return whether both sides have the type of an endpoint of callboard, with one definition."""
        type_name, found = endpoint.type_name, endpoint.type_hash
        known = self._known(type_name)
        if known.reason:
            quiet = type_name.partition("/")[0] in CALLBOARD_PACKAGES
            self._refuse_type(candidate.our_name, type_name, known, quiet=quiet)
            return False
        if found and known.our_hash and found != known.our_hash:
            text = f"the type {type_name} has the hash {found} at {endpoint.node} and {known.our_hash} here"
            self._refuse(candidate.our_name, Reason.TYPE_DIFFERS, text, type_name)
            return False
        return True

    def _their_type_crosses(self, candidate: Candidate, endpoint: SideEndpoint) -> bool:
        """Return the same for an endpoint of the other network."""
        type_name = endpoint.type_name
        known = self._known(type_name)
        if known.reason:
            self._refuse_type(candidate.their_name, type_name, known)
            return False
        if text := known.difference(endpoint.type_hash):
            self._refuse(candidate.their_name, Reason.TYPE_DIFFERS, text, type_name)
        return not text

    def _refuse_type(self, name: str, type_name: str, known: KnownType, *, quiet: bool = False) -> None:
        differs = known.our_hash and known.their_hash
        reason = Reason.TYPE_DIFFERS if differs else Reason.TYPE_MISSING
        self._refuse(name, reason, known.reason, type_name, quiet=quiet)


@lru_cache(maxsize=10_000)  # each plan asks for all names, and few of them are new
def _name_fault(name: str) -> str:
    """Return why a topic or service cannot have a name, "" if it can."""
    try:
        validate_full_topic_name(name)
    except InvalidNameError as error:
        return str(error)
    return ""
