"""A world of callboard graphs, other networks and bridges between them, with delays from a seed.

The bridges use the real plan, rules and election; the world stands for what is beside them. Each step is a
tenth of a second: nodes publish, bridges look at graphs now and then, and show what they have planned a bit
later, each side on its own. The world checks each message as it goes, and raises AssertionError with the seed
if one crosses twice, comes back, or reaches a subscription twice.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict, deque
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.bridges.election import ACTIVE, Election, bridges_in
from actors.bridges.graph import (
    BRIDGE_ID_LABEL,
    BRIDGE_LABEL,
    BRIDGE_STATE_LABEL,
    ORIGIN_LABEL,
    SideEndpoint,
    SideGraph,
    SideNode,
    origin_of,
)
from actors.bridges.plan import EMPTY_PLAN, Plan, SidePlan, plan
from actors.bridges.rules import Rules
from tests.actors.bridges.sides import PUBLISHER, STRING, SUBSCRIPTION, all_known, endpoint

if TYPE_CHECKING:
    from random import Random

STEP_SEC: Final = 0.1
OURS_DELAY: Final = 4
"""Steps until all brokers of a mesh have a change of callboard's graph."""
THEIRS_DELAY: Final = 20
"""The same for another network, whose discovery is slower; less than a bridge lets settle."""
LEASE: Final = 30
"""Steps in which another network still shows a killed bridge."""
LATENCY: Final = 3
"""Steps that a message takes at most to cross."""


class Message(NamedTuple):
    """One message.

    Attributes:
        number: Its number, which stays the same when it crosses.
        topic: The topic.
        home: The network where it was published.
        node: The node that publishes it, or whose mirror does.
        is_mirrored: Whether a mirror publishes it.
    """

    number: int
    topic: str
    home: Network
    node: str
    is_mirrored: bool = False


class View(NamedTuple):
    """What a network shows at one moment."""

    graph: SideGraph
    labels: tuple[dict[str, str], ...]
    """Of the nodes of a callboard graph."""


class Network:
    """One callboard graph, or one other network, with its native nodes and what bridges show in it."""

    def __init__(self, name: str, *, is_ours: bool) -> None:
        self.name = name
        self.is_ours = is_ours
        self.natives: dict[str, set[SideEndpoint]] = {}
        self.bridges: dict[str, Bridge] = {}
        """All bridges that it shows, by their ids; killed ones until their lease has ended."""
        self.history: deque[View] = deque(maxlen=OURS_DELAY)
        """What it showed at the beginnings of the last steps."""
        self.got: dict[tuple[str, str], list[int]] = defaultdict(list)
        """By subscribing node and topic, the numbers of the messages that it got."""

    def __repr__(self) -> str:
        return self.name

    def is_shared(self, name: str) -> bool:
        """Return whether a native node shares its name: in callboard half of them do not."""
        return not self.is_ours or name[-1] in "02468"

    def shown_by(self, bridge: Bridge) -> SidePlan:
        """Return what a bridge shows here."""
        return bridge.shows_here if self.is_ours else bridge.shows_there

    def view(self) -> View:
        """Return what the network shows now, mirrors with their endpoints included."""
        nodes = {SideNode(name, shared=self.is_shared(name)) for name in self.natives}
        endpoints = {each for found in self.natives.values() for each in found}
        labels: list[dict[str, str]] = []
        for bridge in self.bridges.values():
            shown = self.shown_by(bridge)
            own = {BRIDGE_LABEL: bridge.network, BRIDGE_ID_LABEL: bridge.id}
            labels += [own, own | {BRIDGE_STATE_LABEL: ACTIVE}] if bridge.says_active else [own]
            origin = bridge.network if self.is_ours else bridge.id
            control = origin_of(own) if self.is_ours else bridge.id
            nodes |= {SideNode(f"/bridge_{bridge.id}", control, shared=False)}
            labels += [{ORIGIN_LABEL: origin} for _ in shown.nodes]
            nodes |= {SideNode(name, origin) for name in shown.nodes}
            endpoints |= {
                SideEndpoint(each.node, each.kind, each.name, each.type_name, "", each.qos, origin)
                for each in shown.mirrors
            }
        return View(SideGraph(frozenset(nodes), frozenset(endpoints)), tuple(labels))


class Bridge:
    """A bridge between a callboard graph and another network."""

    def __init__(self, bridge_id: str, ours: Network, theirs: Network, network: str) -> None:
        self.id = bridge_id
        self.ours = ours
        self.theirs = theirs
        self.network = network
        """The name of the other network in labels; separate networks can have one name."""
        self.election = Election(bridge_id)
        self.rules = Rules()
        self.shows_here = self.shows_there = EMPTY_PLAN.ours
        self.says_active = False
        self.our_view = self.their_view = View(SideGraph(), ())
        self.their_bridges: frozenset[str] = frozenset()
        self.wanted: Plan | None = None
        """The plan for these views."""
        self.before = EMPTY_PLAN
        self.most_lag = 0
        """Steps that its broker may be behind."""
        self.seen_at = -1
        """The step of which it has callboard's graph."""
        self.looks_at = [0, 0]
        """The steps at which it looks at the nodes and at the bridges of the other network."""
        self.active_since: float | None = None

    def receives(self, message: Message, network: Network) -> tuple[Network, str] | None:
        """Return where a message that was published in a network is to be published, and on which topic."""
        there, shown = (
            (self.theirs, self.shows_there) if network is self.ours else (self.ours, self.shows_here)
        )
        here = network.shown_by(self)
        if message.is_mirrored or (message.topic, STRING) not in here.intake:
            return None
        for mirror in shown.mirrors:
            if (mirror.kind, mirror.source, mirror.source_node) == (PUBLISHER, message.topic, message.node):
                return there, mirror.name
        return None


class World:
    """Networks and bridges.

    Args:
        random: Its chance, from a printed seed.
        seed: The seed.
    """

    def __init__(self, random: Random, seed: int) -> None:
        self.random = random
        self.seed = seed
        self.step_number = 0
        self.networks: list[Network] = []
        self.bridges: list[Bridge] = []
        self._killed: list[tuple[int, Bridge]] = []
        self._crossing: list[tuple[int, Message, Network, Bridge]] = []
        self._crossed: set[tuple[int, Network]] = set()
        self._numbers = itertools.count()

    @property
    def now(self) -> float:
        """The time in seconds."""
        return self.step_number * STEP_SEC

    def network(self, name: str, *, is_ours: bool = False) -> Network:
        """Add a callboard graph or another network."""
        self.networks.append(Network(name, is_ours=is_ours))
        return self.networks[-1]

    def bridge(self, bridge_id: str, ours: Network, theirs: Network, network: str = "ros2/0") -> Bridge:
        """Start a bridge."""
        bridge = Bridge(bridge_id, ours, theirs, network)
        bridge.most_lag = self.random.randrange(OURS_DELAY)
        ours.bridges[bridge_id] = theirs.bridges[bridge_id] = bridge
        self.bridges.append(bridge)
        return bridge

    def kill(self, bridge: Bridge) -> None:
        """Kill a bridge: callboard notices it at once, the other network after its lease."""
        self.bridges.remove(bridge)
        del bridge.ours.bridges[bridge.id]
        self._killed.append((self.step_number + LEASE, bridge))
        self._crossing = [each for each in self._crossing if each[3] is not bridge]

    def cut_off(self, bridge: Bridge) -> None:
        """Take a bridge's connection to callboard; it notices that, and shows nothing any more."""
        del bridge.ours.bridges[bridge.id]
        bridge.election.disconnect()
        bridge.shows_here = bridge.shows_there = EMPTY_PLAN.ours
        bridge.says_active = False
        self._crossing = [each for each in self._crossing if each[3] is not bridge]

    def reconnect(self, bridge: Bridge) -> None:
        """Let a bridge have its connection back."""
        bridge.ours.bridges[bridge.id] = bridge
        bridge.seen_at = self.step_number

    def node(self, network: Network, name: str, publishes: str = "", subscribes: str = "") -> None:
        """Add a native node, or endpoints to it; topics are separated by spaces."""
        endpoints = network.natives.setdefault(name, set())
        endpoints |= {endpoint(name, PUBLISHER, topic) for topic in publishes.split()}
        endpoints |= {endpoint(name, SUBSCRIPTION, topic) for topic in subscribes.split()}

    def require(self, condition: object, text: str) -> None:
        """Raise AssertionError with the seed if a condition does not hold."""
        assert condition, f"seed {self.seed}, {self.now:.1f} s: {text}"

    def run(self, seconds: float) -> None:
        """Let some time pass."""
        for _ in range(round(seconds / STEP_SEC)):
            self.step()

    def step(self) -> None:
        """Let a tenth of a second pass."""
        self.step_number += 1
        for ended in [each for each in self._killed if each[0] <= self.step_number]:
            self._killed.remove(ended)
            del ended[1].theirs.bridges[ended[1].id]
        for network in self.networks:
            if network.is_ours:
                network.history.append(network.view())
        for bridge in self.random.sample(self.bridges, len(self.bridges)):
            if bridge.id in bridge.ours.bridges:
                self._drive(bridge)
        pairs = Counter((each.ours.name, each.theirs.name) for each in self.active(*self.bridges))
        self.require(all(count == 1 for count in pairs.values()), f"two bridges are active: {pairs}")
        for network in self.networks:
            for name, endpoints in network.natives.items():
                for topic in sorted({each.name for each in endpoints if each.kind is PUBLISHER}):
                    self._publish(Message(next(self._numbers), topic, network, name), network)
        self._let_arrive()

    def _let_arrive(self) -> None:
        """Publish what has crossed."""
        arrived = [each for each in self._crossing if each[0] <= self.step_number]
        self._crossing = [each for each in self._crossing if each[0] > self.step_number]
        for _, message, network, bridge in arrived:
            # A mirror that has gone meanwhile publishes nothing any more.
            shown = network.shown_by(bridge)
            if any((each.kind, each.node) == (PUBLISHER, message.node) for each in shown.mirrors):
                self._publish(message, network)

    def _drive(self, bridge: Bridge) -> None:
        """Let a bridge look, decide and show."""
        self._look(bridge)
        others = bridges_in(bridge.our_view.labels, bridge.network)
        bridge.says_active = bridge.election.update(self.now, others, bridge.their_bridges)
        if not bridge.says_active:
            bridge.shows_here = bridge.shows_there = EMPTY_PLAN.ours
            bridge.active_since = None
            return
        if bridge.active_since is None:
            bridge.active_since = self.now
        if bridge.wanted is None:
            graphs = bridge.our_view.graph, bridge.their_view.graph
            bridge.wanted = bridge.before = plan(*graphs, bridge.rules, all_known, bridge.before)
            for graph, side in zip(graphs, (bridge.wanted.theirs, bridge.wanted.ours), strict=True):
                natives = {(each.node, each.kind, each.name) for each in graph.endpoints if not each.origin}
                mirrored = {(each.source_node, each.kind, each.source) for each in side.mirrors}
                self.require(mirrored <= natives, f"{bridge.id} mirrors a mirror")
                names = {each.name for each in graph.nodes if not each.origin}
                self.require(names.issuperset(side.nodes.values()), f"{bridge.id} mirrors a mirror's node")
        if self.random.randrange(2):
            bridge.shows_here = bridge.wanted.ours
        if self.random.randrange(2):
            bridge.shows_there = bridge.wanted.theirs

    def _look(self, bridge: Bridge) -> None:
        """Let a bridge see what its sides have shown some steps ago, or show now."""
        # Its broker may be behind the others of the mesh, and never goes back.
        if bridge.seen_at < 0 or self.random.randrange(2):
            lag = self.random.randint(0, bridge.most_lag)
            bridge.seen_at = max(bridge.seen_at, self.step_number - min(lag, len(bridge.ours.history) - 1))
            bridge.our_view, bridge.wanted = bridge.ours.history[bridge.seen_at - self.step_number - 1], None
        # Discovery finds nodes one by one: natives may be seen before a bridge is.
        if self.step_number == bridge.looks_at[0]:
            bridge.their_view, bridge.wanted = bridge.theirs.view(), None
        if self.step_number == bridge.looks_at[1]:
            bridge.their_bridges = frozenset(bridge.theirs.bridges)
        for index, step in enumerate(bridge.looks_at):
            if step <= self.step_number:
                bridge.looks_at[index] = self.step_number + self.random.randint(1, THEIRS_DELAY)

    def _publish(self, message: Message, network: Network) -> None:
        """Deliver a message in a network, and give it to the bridges that subscribe to its topic."""
        for name, endpoints in network.natives.items():
            if any(each.kind is SUBSCRIPTION and each.name == message.topic for each in endpoints):
                got = network.got[name, message.topic]
                self.require(
                    message.number not in got[-1000:], f"{name} of {network.name} got {message} twice"
                )
                got.append(message.number)
        for bridge in self.bridges:
            if network not in {bridge.ours, bridge.theirs}:
                continue
            crossing = bridge.receives(message, network)
            if crossing is None:
                continue
            target, topic = crossing
            self.require(target is not message.home, f"{message} comes back to {target.name}")
            self.require((message.number, target) not in self._crossed, f"{message} crosses twice")
            self._crossed.add((message.number, target))
            shown = target.shown_by(bridge)
            node = next(name for name, original in shown.nodes.items() if original == message.node)
            copy = Message(message.number, topic, message.home, node, is_mirrored=True)
            arrives = self.step_number + self.random.randint(1, LATENCY)
            self._crossing.append((arrives, copy, target, bridge))

    def active(self, *bridges: Bridge) -> list[Bridge]:
        """Return those of some bridges that are active."""
        return [each for each in bridges if each.election.active and each in self.bridges]

    def settle(self) -> None:
        """Let all that is under way arrive, and check that each bridge shows what the graphs ask for."""
        self.run(12)
        for bridge in self.bridges:
            graphs = bridge.ours.view().graph, bridge.theirs.view().graph
            asked = plan(*graphs, bridge.rules, all_known, bridge.before)
            shown = asked if bridge.election.active else EMPTY_PLAN
            self.require(bridge.shows_here == shown.ours, f"{bridge.id} does not show what it should here")
            self.require(
                bridge.shows_there == shown.theirs, f"{bridge.id} does not show what it should there"
            )
            alone = {each for each in bridge.ours.natives if not bridge.ours.is_shared(each)}
            self.require(not alone & bridge.shows_here.nodes.keys(), f"{bridge.id} takes a name")
        for network in self.networks:
            network.got.clear()
        self.run(2)

    def reached(self, network: Network, node: str, topic: str) -> int:
        """Return how many messages a node has got on a topic since the world settled."""
        return len(network.got[node, topic])
