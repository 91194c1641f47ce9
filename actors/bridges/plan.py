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
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from actors.bridges.qos import (
    common_offer,
    intake_profiles,
    is_latched,
    merged_offer,
    mirror_offer,
    mirror_request,
    receiver_of,
)
from actors.bridges.report import Reason, Refusal
from actors.bridges.rules import GLOBAL_TOPICS, action_of
from proto.errors import InvalidNameError
from proto.untrusted_text import peer_name, peer_text
from proto.wire.codes import EntryKind
from proto.wire.names import (
    MAX_NODE_NAME_LENGTH,
    split_node_name,
    validate_full_topic_name,
    validate_namespace,
    validate_node_name,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.bridges.graph import SideEndpoint, SideGraph
    from actors.bridges.rules import Rules
    from actors.qos.profile import QoSProfile

CALLBOARD_PACKAGES: Final = frozenset({"callboard_interfaces"})
"""Packages of types that exist in callboard only: nobody expects them elsewhere."""
CLOCK: Final = "/clock"

_PUBLISHER: Final = EntryKind.PUBLISHER
_SUBSCRIPTION: Final = EntryKind.SUBSCRIPTION
_SERVICE: Final = EntryKind.SERVICE
_CLIENT: Final = EntryKind.CLIENT

Topic = tuple[str, str]
"""The full name of a topic on its side, and its type."""


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
        before: The plan before. A mirror whose name was taken keeps its other name, because the node that has
            the name may be restarting, and could not come back if the mirror took it.

    Returns:
        The plan; equal graphs after equal plans give equal plans.
    """
    return _Planner(ours, theirs, rules, known, before.ours.nodes).plan()


class _Channel:
    """One topic or service with its endpoints on both sides."""

    __slots__ = ("depth", "is_service", "our_name", "ours", "their_name", "theirs")

    def __init__(self, our_name: str, their_name: str, depth: int | None, *, is_service: bool) -> None:
        self.our_name = our_name
        self.their_name = their_name
        self.depth = depth
        """The depth that a rule sets for its mirrors."""
        self.is_service = is_service
        self.ours: list[SideEndpoint] = []
        self.theirs: list[SideEndpoint] = []

    def endpoints(self) -> list[SideEndpoint]:
        return self.ours + self.theirs

    def on_both_sides(self, kind: EntryKind) -> bool:
        """Return whether both sides have a native endpoint of a kind."""
        return any(each.kind is kind for each in self.ours) and any(each.kind is kind for each in self.theirs)

    @property
    def name(self) -> str:
        """The name on the side where it is native; the other network's, if it is on both."""
        return self.their_name if self.theirs else self.our_name


class _Planner:
    """Makes one plan."""

    def __init__(
        self,
        ours: SideGraph,
        theirs: SideGraph,
        rules: Rules,
        known: Callable[[str], KnownType],
        before: dict[str, str],
    ) -> None:
        self._before = before
        """The names of mirror nodes in callboard, with those of their originals."""
        self._ours = ours
        self._theirs = theirs
        self._rules = rules
        self._known = known
        self._our_natives = {node.name for node in ours.nodes if not node.origin}
        self._their_natives = {node.name for node in theirs.nodes if not node.origin}
        self._channels: dict[tuple[str, bool], _Channel] = {}
        self._restricted = set[str]()
        """Nodes of the other network with an endpoint that the rules hide."""
        self._refusals = set[Refusal]()

    def plan(self) -> Plan:
        self._collect()
        self._refuse_actions_served_twice()
        channels = [channel for channel in self._channels.values() if self._check(channel)]
        our_names = self._names_here(self._visible_there(channels))
        crossing = {each.node for channel in channels for each in channel.ours}
        their_names = self._names_there(crossing)
        # Of a node that is not shown nothing crosses.
        for channel in channels if len(our_names) < len(self._their_natives) else ():
            channel.theirs = [each for each in channel.theirs if each.node in our_names]
        for channel in channels if len(their_names) < len(crossing) else ():
            channel.ours = [each for each in channel.ours if each.node in their_names]
        here, there = _Side(our_names), _Side(their_names)
        surplus: list[_Channel] = []
        most = self._rules.max_endpoints
        if sum(len(channel.ours) + len(channel.theirs) for channel in channels) > most:
            channels.sort(key=lambda channel: (channel.their_name, channel.is_service))
        for channel in channels:
            if here.size + len(channel.theirs) > most or there.size + len(channel.ours) > most:
                surplus.append(channel)
                continue
            here.show(channel, channel.our_name, channel.ours, channel.their_name, channel.theirs)
            there.show(channel, channel.their_name, channel.theirs, channel.our_name, channel.ours)
        if surplus:
            text = f"{len(surplus)} topics and services are beyond max_endpoints = {most}: allow fewer"
            self._refuse(surplus[0].name, Reason.LIMIT, text)
        return Plan(here.plan(), there.plan(), tuple(sorted(self._refusals)))

    # What could cross.

    def _collect(self) -> None:
        """Sort the endpoints of native nodes by topic and service, without those that the rules hide."""
        rules, natives = self._rules, self._our_natives
        for endpoint in self._ours.endpoints:
            if endpoint.origin or endpoint.node not in natives:
                continue
            name = rules.name_there(endpoint.name)
            if name is not None and rules.crosses(name):
                self._channel(endpoint.name, name, endpoint.kind).ours.append(endpoint)
        natives = self._their_natives
        for endpoint in self._theirs.endpoints:
            if endpoint.origin or endpoint.node not in natives:
                continue
            if rules.crosses(endpoint.name):
                channel = self._channel(rules.name_here(endpoint.name), endpoint.name, endpoint.kind)
                channel.theirs.append(endpoint)
            else:
                self._restricted.add(endpoint.node)

    def _channel(self, our_name: str, their_name: str, kind: EntryKind) -> _Channel:
        key = their_name, kind is _SERVICE or kind is _CLIENT
        channel = self._channels.get(key)
        if channel is None:
            depth = None if key[1] else self._rules.depth_of(their_name)
            channel = self._channels[key] = _Channel(our_name, their_name, depth, is_service=key[1])
        return channel

    def _refuse(
        self, name: str, reason: Reason, text: str, type_name: str = "", *, quiet: bool = False
    ) -> None:
        # Other networks check neither names nor types as a broker does.
        self._refusals.add(Refusal(peer_name(name), reason, peer_text(text), peer_name(type_name), quiet))

    def _refuse_actions_served_twice(self) -> None:
        """Remove the services and topics of actions that both sides serve."""
        served = {
            action
            for channel in self._channels.values()
            if (action := action_of(channel.their_name)) and channel.on_both_sides(_SERVICE)
        }
        if not served:
            return
        for action in served:
            self._refuse(action, Reason.SERVED_TWICE, f"both sides have a server of the action {action}")
        self._channels = {
            key: channel
            for key, channel in self._channels.items()
            if action_of(channel.their_name) not in served
        }

    def _check(self, channel: _Channel) -> bool:
        """Remove from a channel what cannot cross; return whether something is left."""
        if channel.is_service:
            if channel.on_both_sides(_SERVICE):
                # Both nodes have the name, which is reported; their parameter services are no news.
                quiet = channel.our_name.rpartition("/")[0] in self._our_natives
                text = f"both sides have a server of {channel.their_name}: each side keeps its own"
                self._refuse(channel.their_name, Reason.SERVED_TWICE, text, quiet=quiet)
                return False
        elif channel.their_name == CLOCK and not self._check_clock(channel):
            return False
        if not self._check_name(channel):
            return False
        self._check_types(channel)
        return bool(channel.ours or channel.theirs)

    def _check_clock(self, channel: _Channel) -> bool:
        if channel.on_both_sides(_PUBLISHER):
            text = "both sides publish the time: each side keeps its own"
            self._refuse(channel.name, Reason.SECOND_CLOCK, text)
            return False
        for endpoints in (channel.ours, channel.theirs):
            nodes = sorted({each.node for each in endpoints if each.kind is _PUBLISHER})
            for node in nodes[1:]:
                text = f"{nodes[0]} publishes the time: the time of {node} does not cross"
                self._refuse(channel.name, Reason.SECOND_CLOCK, text)
            if len(nodes) > 1:
                endpoints[:] = [each for each in endpoints if each.node not in nodes[1:]]
        return True

    def _check_name(self, channel: _Channel) -> bool:
        fault = _name_fault(channel.our_name) or _name_fault(channel.their_name)
        if fault:
            self._refuse(channel.name, Reason.INVALID_NAME, fault)
        return not fault

    def _check_types(self, channel: _Channel) -> None:
        """Leave the endpoints of the one type that crosses."""
        # Subscriptions of callboard that take every type: they take the one that crosses.
        untyped = [each for each in channel.ours if not each.type_name]
        channel.ours[:] = [each for each in channel.ours if each.type_name]
        self._choose_type(channel)
        for type_name in {each.type_name for each in channel.theirs}:
            channel.ours += [each._replace(type_name=type_name) for each in untyped]

    def _choose_type(self, channel: _Channel) -> None:
        types = {each.type_name for each in channel.endpoints()}
        channel.ours[:] = [each for each in channel.ours if self._has_type(channel.our_name, each, here=True)]
        channel.theirs[:] = [
            each for each in channel.theirs if self._has_type(channel.their_name, each, here=False)
        ]
        if len(types) == 1:
            return
        # What both sides have comes first: it may cross already. Then what the other network has itself: its
        # nodes decided what the topic carries.
        here = {each.type_name for each in channel.ours}
        there = {each.type_name for each in channel.theirs}
        usable = here & there or there or here
        if not usable:
            return
        chosen = min(usable)
        for other in sorted({each.type_name for each in channel.endpoints()} - {chosen}):
            text = (
                f"{channel.name} crosses as {chosen}, and a process of the other network has one type for it"
            )
            self._refuse(channel.name, Reason.SECOND_TYPE, text, other)
        for endpoints in (channel.ours, channel.theirs):
            endpoints[:] = [each for each in endpoints if each.type_name == chosen]

    def _has_type(self, name: str, endpoint: SideEndpoint, *, here: bool) -> bool:
        """Return whether both sides have an endpoint's type with one definition."""
        type_name, found = endpoint.type_name, endpoint.type_hash
        known = self._known(type_name)
        if known.reason:
            differs = known.our_hash and known.their_hash
            reason = Reason.TYPE_DIFFERS if differs else Reason.TYPE_MISSING
            quiet = here and type_name.partition("/")[0] in CALLBOARD_PACKAGES
            self._refuse(name, reason, known.reason, type_name, quiet=quiet)
            return False
        if not here:
            text = known.difference(found)
        elif found and known.our_hash and found != known.our_hash:
            text = f"the type {type_name} has the hash {found} at {endpoint.node} and {known.our_hash} here"
        else:
            return True
        if text:
            self._refuse(name, Reason.TYPE_DIFFERS, text, type_name)
        return not text

    # Who is shown, and under which name.

    def _visible_there(self, channels: Iterable[_Channel]) -> set[str]:
        """Return the nodes of the other network to show: not those of which the rules hide everything."""
        if not self._restricted:
            return self._their_natives
        seen = {
            each.node
            for channel in channels
            if channel.their_name not in GLOBAL_TOPICS
            for each in channel.theirs
        }
        return self._their_natives - (self._restricted - seen)

    def _names_here(self, nodes: set[str]) -> dict[str, str]:
        """Return the names in callboard of nodes of the other network."""
        taken = {node.name for node in self._ours.nodes if not node.shared}
        wanted = {name: self._rules.node_here(name) for name in nodes}
        # Whether the name is free now or not: see `plan`.
        taken |= {
            wanted[original]
            for name, original in self._before.items()
            if original in wanted and name != wanted[original]
        }
        return self._assign(wanted, taken, "_ros2", "a callboard node has its name and does not share it")

    def _names_there(self, nodes: set[str]) -> dict[str, str]:
        """Return the names in the other network of nodes of callboard."""
        wanted = {name: self._rules.node_there(name) for name in nodes}
        return self._assign(wanted, self._their_natives, "_callboard", "another node has its name there")

    def _assign(
        self, wanted: dict[str, str], taken: Iterable[str], suffix: str, cause: str
    ) -> dict[str, str]:
        """Return the names of mirror nodes by their originals' names, each once and none that is taken."""
        used = set(taken)
        names: dict[str, str] = {}
        # Free names come first, then those that only lose the namespace: both keep exactly their name.
        order = sorted(wanted.items(), key=lambda item: (item[1] in used, item[0] == item[1], item))
        most = self._rules.max_nodes
        if len(order) > most:
            text = f"{len(order) - most} nodes are beyond max_nodes = {most}: allow fewer topics and services"
            self._refuse(order[most][0], Reason.LIMIT, text)
            del order[most:]
        for original, name in order:
            chosen = name
            while chosen in used:
                chosen += suffix
            if not _is_node_name(chosen):
                self._refuse(original, Reason.INVALID_NAME, f"a node cannot be called {chosen}")
                continue
            used.add(chosen)
            names[original] = chosen
            if chosen != name:
                text = f"{original} appears as {chosen}: {cause}"
                self._refuse(original, Reason.NAME_TAKEN, text)
        return names


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
        channel: _Channel,
        name: str,
        natives: list[SideEndpoint],
        source: str,
        originals: list[SideEndpoint],
    ) -> None:
        """Add a topic or service.

        Args:
            channel: What it is.
            name: Its name on this side.
            natives: Its endpoints of this side.
            source: Its name on the other side.
            originals: Its endpoints of the other side, to be shown here.
        """
        if channel.is_service:
            self._mirrors.extend(
                Mirror(self._names[node], kind, name, originals[0].type_name, None, source, node)
                for node, kind in {(each.node, each.kind) for each in originals}
            )
            return
        merged: dict[tuple[str, EntryKind], list[SideEndpoint]] = defaultdict(list)
        for each in originals:
            merged[each.node, each.kind].append(each)
        profiles = self._receive(channel, name, natives, originals)
        for (node, kind), endpoints in merged.items():
            if kind is _PUBLISHER:
                offers = [mirror_offer(channel.their_name, _qos(each), channel.depth) for each in endpoints]
                qos = merged_offer(offers)
            else:
                qos = profiles[-1] if profiles else mirror_request(_qos(endpoints[0]))
            type_name = endpoints[0].type_name
            self._mirrors.append(Mirror(self._names[node], kind, name, type_name, qos, source, node))

    def _receive(
        self, channel: _Channel, name: str, natives: list[SideEndpoint], originals: list[SideEndpoint]
    ) -> tuple[QoSProfile, ...] | None:
        """Add a topic to the intake if it has publishers here and subscriptions there."""
        publishers: dict[str, list[QoSProfile]] = defaultdict(list)
        for each in natives:
            if each.kind is _PUBLISHER:
                publishers[each.node].append(_qos(each))
        offers = {node: common_offer(each) for node, each in publishers.items()}
        demanded = any(each.kind is _SUBSCRIPTION for each in originals)
        if not offers or not (demanded or any(map(is_latched, offers.values()))):
            return None
        profiles = intake_profiles(channel.their_name, offers.values(), channel.depth)
        (self._intake if demanded else self._latched)[name, natives[0].type_name] = profiles
        if len(profiles) > 1:
            self._receivers.update(
                ((name, node), receiver_of(profiles, each)) for node, each in offers.items()
            )
        return profiles if demanded else None

    def plan(self) -> SidePlan:
        nodes = {name: original for original, name in self._names.items()}
        return SidePlan(nodes, frozenset(self._mirrors), self._intake, self._latched, self._receivers)


@lru_cache(maxsize=10_000)  # each plan asks for all names, and few of them are new
def _name_fault(name: str) -> str:
    """Return why a topic or service cannot have a name, "" if it can."""
    try:
        validate_full_topic_name(name)
    except InvalidNameError as error:
        return str(error)
    return ""


def _qos(endpoint: SideEndpoint) -> QoSProfile:
    assert endpoint.qos is not None, f"{endpoint.name} is a topic"
    return endpoint.qos


def _is_node_name(full: str) -> bool:
    namespace, name = split_node_name(full)
    try:
        validate_node_name(name)
        validate_namespace(namespace or "/")
    except InvalidNameError:
        return False
    return len(name) <= MAX_NODE_NAME_LENGTH
