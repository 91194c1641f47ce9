"""A simulated mesh: what brokers tell each other is delayed, held, and lost as the seed determines.

Between two brokers everything keeps its order, except that what is put into a full sending queue (Zenoh's
sending thread) is overtaken by what the engine sends itself: subscriptions, requests and snapshots. A route
that changes loses what is on its way, and nobody is told. A partition that lasts for a lease ends what both
sides know of each other; a shorter one only delays.
"""

from __future__ import annotations

from collections import deque
from contextvars import Context, copy_context
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Final, NamedTuple

from broker.mesh import wire
from broker.mesh.engine.engine import EngineStats, Traffic
from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Publish
from proto.errors import ProtocolError
from proto.wire.frames import Attached, Batch
from tests.simulation.network import host_in

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.engine.engine import Host
    from broker.mesh.mesh import Mesh
    from broker.mesh.messages import Message
    from tests.simulation.loop import SimulatedLoop

LEASE_SEC: Final = 3.0
ASK_TIMEOUT_SEC: Final = 5.0
ASK_AGAIN_SEC: Final = 1.0

QUEUE_BYTES: Final = 64 * 1024
"""What waits for a slow network before an engine is full."""

DELAYS: Final = ((0.0002, 0.0), (0.001, 0.002), (0.02, 0.03), (0.005, 0.1))
"""Fixed and random part of a path's delay, in seconds."""

MAX_DELAY_SEC: Final = 0.11

FAST_RATES: Final = (None, None, 20_000_000)
SLOW_RATES: Final = (*FAST_RATES, 500_000)
"""Bytes per second that an engine sends."""

DECODER: Final = wire.MessageDecoder()

_KERNEL: Final = Context()


class _Item(NamedTuple):
    due: float
    action: Callable[[], None]
    declares: bool
    raw: bytes


class _Path:
    """What is on its way from one engine to another."""

    def __init__(self, mesh: MeshNetwork, source: SimulatedEngine, target: SimulatedEngine) -> None:
        self.source = source
        self.target = target
        self.closed = False
        self._mesh = mesh
        self._random = Random(f"{mesh.seed} {source.place}{source.life}>{target.place}{target.life}")
        self._delay = self._random.choice(DELAYS)
        self._last_arrival = 0.0
        self._flight: deque[_Item] = deque()

    def send(self, action: Callable[[], None], *, declares: bool = False, raw: bytes = b"") -> None:
        """Let something happen at the target, after all that was sent before.

        Args:
            action: What happens.
            declares: Whether a route that changes does not lose it.
            raw: A message of a topic.
        """
        if self.closed:
            return
        fixed, jitter = self._delay
        due = self._mesh.loop.time() + fixed + jitter * self._random.random()
        self._last_arrival = max(self._last_arrival, due)
        self._flight.append(_Item(self._last_arrival, action, declares, raw))
        self._mesh.loop.call_at(self._last_arrival, self.arrive, context=_KERNEL)

    def arrive(self) -> None:
        """Hand over what is due, unless the brokers are separated."""
        now = self._mesh.loop.time() + 1e-6
        while self._flight and self._flight[0].due <= now and not self._mesh.separated(self):
            action = self._flight.popleft().action
            self._mesh.loop.call_soon(self.target.run, action, context=self.target.context)

    def lose(self) -> None:
        """Lose the messages on their way; Zenoh declares subscriptions and tokens again on the new route."""
        for item in self._flight:
            frame = DECODER.published(item.raw) if item.raw else None
            if isinstance(frame, Batch):
                numbers = range(frame.first_sequence, frame.first_sequence + frame.length)
                self._mesh.lost.setdefault((self.target.place, frame.publisher), set()).update(numbers)
        self._flight = deque(item for item in self._flight if item.declares)

    def close(self) -> None:
        """Lose everything, and take nothing until `announce`."""
        self.closed = True
        self._flight.clear()


class SimulatedEngine:
    """A broker's part in a simulated mesh (`broker.mesh.engine.engine.Engine`).

    Attributes:
        place: The simulated host of its broker.
        context: That of its broker.
    """

    def __init__(self, network: MeshNetwork, number: int, host: Host) -> None:
        self.number = number
        self.context = copy_context()
        self.place = host_in(self.context)
        self.life = network.lives(self.place)
        self.alive = False
        self.meshes: dict[int, Mesh] = {}
        self.topics: set[tuple[int, str]] = set()
        self._network = network
        self._host = host
        self._topics_of: dict[int, set[tuple[int, str]]] = {}
        self._domains_of: dict[int, set[int]] = {}
        self._asked: dict[int, tuple[int, int]] = {}
        self._asks = 0
        self._random = Random(f"{network.seed} engine {self.place} {self.life}")
        self._rate = self._random.choice(network.rates)
        self._queue: deque[tuple[int, Callable[[], None]]] = deque()
        self._queued_bytes = 0
        self._free_at = 0.0
        self._sending = False
        self._was_full = False

    # Engine

    async def start(self) -> None:
        """Take part in the mesh."""
        self.alive = True
        self._network.add(self)

    def join(self, domain: int) -> None:
        """Declare a token."""
        self.meshes[domain] = self._host.mesh(domain)
        for path in self._network.paths(self):
            self._declare(path, lambda target: target.heard_alive(self, domain))

    @property
    def full(self) -> bool:
        """Whether the sending queue is."""
        self._was_full = self.backed_up
        return self._was_full

    @property
    def backed_up(self) -> bool:
        """Whether a slow network holds up more than a moment's messages."""
        return self._queued_bytes > QUEUE_BYTES

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages."""
        if not self.alive:
            return
        for message in messages:
            if isinstance(message, Publish):
                self._publish(domain, message)
            elif isinstance(message, Direct):
                self._send_direct(domain, message)
            elif isinstance(message, Change):
                change = wire.encode_change(message)
                self._put(len(change[0]), partial(self._send_change, domain, *change))
            elif isinstance(message, Heartbeat):
                beat = wire.encode_heartbeat(message)
                self._put(len(beat), partial(self._send_heartbeat, domain, beat))
            elif isinstance(message, Ask):
                self._ask(domain, message)
            else:
                self._subscribe((domain, message.topic), wanted=message.wanted)

    def statistics(self) -> EngineStats:
        """Return its numbers."""
        return EngineStats({number: Traffic() for number in self._domains_of})

    async def stop(self) -> None:
        """Send what waits, and leave."""
        if not self.alive:
            return
        while self._queue:
            self._queue.popleft()[1]()
        self._network.remove(self)

    # Sending

    def choke(self, seconds: float) -> None:
        """Send nothing for a while."""
        self._free_at = max(self._free_at, self._network.loop.time()) + seconds

    def _put(self, size: int, action: Callable[[], None]) -> None:
        """Give something to the sending thread."""
        self._queue.append((size, action))
        self._queued_bytes += size
        if not self._sending:
            self._depart()

    def _depart(self) -> None:
        """Send until the network is busy."""
        self._sending = False
        now = self._network.loop.time()
        while self._queue and self._free_at <= now + 1e-6:
            size, action = self._queue.popleft()
            self._queued_bytes -= size
            action()
            if self._rate is not None:
                self._free_at = max(self._free_at, now) + size / self._rate
        if self._queue:
            self._sending = True
            self._network.loop.call_at(self._free_at, self._depart, context=self.context)
        if self._was_full and self._queued_bytes <= QUEUE_BYTES:
            self._was_full = False
            self._network.loop.call_soon(self.run, lambda: None, context=self.context)

    def _publish(self, domain: int, message: Publish) -> None:
        raw, topic = bytes(message.raw), (domain, message.topic)

        def put() -> None:
            for path in self._network.paths(self):
                if topic in self._topics_of.get(path.target.number, ()):
                    path.send(partial(path.target.hear_published, topic, raw), raw=raw)

        self._put(len(raw), put)

    def _send_direct(self, domain: int, message: Direct) -> None:
        payload, attachment = wire.encode_direct(message)

        def put() -> None:
            path = self._network.path(self, message.broker)
            if path is not None:
                path.send(lambda: path.target.hear_direct(self.number, domain, payload, attachment))

        self._put(len(payload), put)

    def _send_change(self, domain: int, payload: bytes, attachment: bytes) -> None:
        for path in self._network.paths(self):
            path.send(partial(path.target.hear_change, self.number, domain, payload, attachment))

    def _send_heartbeat(self, domain: int, payload: bytes) -> None:
        for path in self._network.paths(self):
            path.send(partial(path.target.hear_heartbeat, self.number, domain, payload))

    def _subscribe(self, topic: tuple[int, str], *, wanted: bool) -> None:
        (self.topics.add if wanted else self.topics.discard)(topic)
        for path in self._network.paths(self):
            self._declare(path, lambda target: target.hear_wanted(self, topic, wanted=wanted))

    def announce(self, path: _Path) -> None:
        """Declare everything to an engine that is, or is again, connected."""
        path.closed = False
        domains, topics = tuple(self.meshes), frozenset(self.topics)

        def learn(target: SimulatedEngine) -> None:
            target.learn_topics(self, topics)
            for domain in domains:
                target.heard_alive(self, domain)

        self._declare(path, learn)

    def _declare(self, path: _Path, declaration: Callable[[SimulatedEngine], None]) -> None:
        path.send(lambda: declaration(path.target), declares=True)

    def _ask(self, domain: int, ask: Ask) -> None:
        self._asks += 1
        token = self._asks
        payload = wire.encode_ask(self.number, ask.epoch)
        path = self._network.path(self, ask.broker)
        if path is None or path.closed:
            self._later(ASK_AGAIN_SEC, lambda: self._unanswered(domain, ask.broker))
            return
        self._asked[token] = domain, ask.broker
        path.send(lambda: path.target.answer(self, domain, token, payload))
        self._later(ASK_TIMEOUT_SEC, lambda: self._ask_expired(token))

    def _ask_expired(self, token: int) -> None:
        asked = self._asked.pop(token, None)
        if asked is not None:
            self._later(ASK_AGAIN_SEC, lambda: self._unanswered(*asked))

    def _unanswered(self, domain: int, broker: int) -> None:
        if self.alive:
            self.meshes[domain].accept_snapshot(broker, None)

    def _later(self, seconds: float, call: Callable[[], None]) -> None:
        self._network.loop.call_later(seconds, call, context=self.context)

    # Receiving

    def run(self, action: Callable[[], None]) -> None:
        """Handle something, in the context of its broker."""
        if self.alive:
            action()
            self._host.flush()
            self._network.handled(self.place)

    def heard_alive(self, other: SimulatedEngine, domain: int) -> None:
        """A token has come."""
        domains = self._domains_of.setdefault(other.number, set())
        if domain not in domains:
            domains.add(domain)
            self._host.mesh(domain).add_broker(other.number)

    def hear_of(self, number: int, *, alive: bool = True) -> None:
        """See the token of a broker that is none, or its end."""
        domains = tuple(self.meshes)

        def see() -> None:
            for domain in domains:
                mesh = self.meshes[domain]
                (mesh.add_broker if alive else mesh.remove_broker)(number)

        self._network.loop.call_soon(self.run, see, context=self.context)

    def forget(self, other: SimulatedEngine) -> None:
        """All tokens of a broker have gone."""
        self._topics_of.pop(other.number, None)
        for domain in self._domains_of.pop(other.number, ()):
            self._host.mesh(domain).remove_broker(other.number)

    def learn_topics(self, other: SimulatedEngine, topics: frozenset[tuple[int, str]]) -> None:
        """Replace the topics that a broker wants."""
        self._topics_of[other.number] = set(topics)

    def hear_wanted(self, other: SimulatedEngine, topic: tuple[int, str], *, wanted: bool) -> None:
        """A broker wants a topic, or does not any more."""
        topics = self._topics_of.setdefault(other.number, set())
        (topics.add if wanted else topics.discard)(topic)

    def hear_published(self, topic: tuple[int, str], raw: bytes) -> None:
        """Take a message of a topic."""
        if topic in self.topics:
            frame = DECODER.published(raw)
            self._host.mesh(topic[0]).receive(frame.publisher >> 32, frame, topic[1])

    def hear_direct(self, broker: int, domain: int, payload: bytes, attachment: bytes) -> None:
        """Take a direct message."""
        if domain in self.meshes:
            self._take(broker, domain, lambda: DECODER.direct(self.number, payload, attachment))

    def hear_change(self, broker: int, domain: int, payload: bytes, attachment: bytes) -> None:
        """Take a change."""
        if domain in self.meshes:
            self._take(broker, domain, lambda: DECODER.change(payload, attachment))

    def _take(self, broker: int, domain: int, decode: Callable[[], Change | Direct]) -> None:
        mesh = self.meshes[domain]
        try:
            message = decode()
            if isinstance(message.frame, Attached):
                live, key = self._network.live, (self.place, message.frame.gid)
                live[key] = max(live.get(key, 0), message.frame.first_sequence)
            mesh.receive(broker, message)
        except ProtocolError as error:
            mesh.reject(broker, str(error))

    def hear_heartbeat(self, broker: int, domain: int, payload: bytes) -> None:
        """Take a heartbeat."""
        if domain in self.meshes:
            self.meshes[domain].accept_heartbeat(broker, wire.decode_heartbeat(payload))

    def answer(self, asker: SimulatedEngine, domain: int, token: int, payload: bytes) -> None:
        """Answer a request for the snapshot, most of the time."""
        path = self._network.path(self, asker.number)
        if path is None or domain not in self.meshes or self._random.random() < self._network.unanswered:
            return
        reply = wire.encode_snapshot(self.meshes[domain].snapshot(*wire.decode_ask(payload)))
        path.send(lambda: asker.answered(token, reply))

    def answered(self, token: int, payload: bytes) -> None:
        """Take a snapshot, unless the request has expired."""
        asked = self._asked.pop(token, None)
        if asked is not None:
            domain, broker = asked
            self.meshes[domain].accept_snapshot(broker, DECODER.lazy_snapshot(payload))


class MeshNetwork:
    """All engines, the paths between them, and their faults.

    Args:
        loop: The simulated loop.
        seed: Of all that happens by chance.

    Attributes:
        unanswered: The share of requests for snapshots that get no answer.
        rates: What engines choose their rate from.
        handled: Called with the host of a broker that has handled something.
        lost: By a broker's host and the key of a publisher, the numbers of the messages that a change of
            routes has lost, and that nothing repairs.
        live: By a broker's host and the public gid of a publisher, from which number on it has been attached;
            what comes before is latched, and may be replaced by newer messages before it is sent.
    """

    def __init__(self, loop: SimulatedLoop, seed: int) -> None:
        self.loop = loop
        self.seed = seed
        self.unanswered = 0.0
        self.rates: tuple[int | None, ...] = SLOW_RATES
        self.handled: Callable[[str], object] = lambda _: None
        self.lost: dict[tuple[str, int], set[int]] = {}
        self.live: dict[tuple[str, bytes], int] = {}
        self._random = Random(f"{seed} mesh network")
        self._engines: dict[int, SimulatedEngine] = {}
        self._paths: dict[tuple[int, int], _Path] = {}
        self._cut: dict[frozenset[str], object] = {}
        """Pairs of hosts that are separated; each separation is another object."""
        self._lives: dict[str, int] = {}

    def lives(self, place: str) -> int:
        """Count and return the lives of the broker of a host."""
        self._lives[place] = self._lives.get(place, 0) + 1
        return self._lives[place]

    @property
    def engines(self) -> list[SimulatedEngine]:
        """Those that are alive."""
        return list(self._engines.values())

    def path(self, source: SimulatedEngine, number: int) -> _Path | None:
        """Return the path from an engine to a broker; None if that is not alive."""
        return self._paths.get((source.number, number))

    def paths(self, source: SimulatedEngine) -> list[_Path]:
        """Return the paths from an engine to all others."""
        return [path for path in self._paths.values() if path.source is source]

    def separated(self, path: _Path) -> bool:
        """Return whether a partition is between the ends of a path."""
        pair = frozenset((path.source.place, path.target.place))
        return path.source.alive and pair in self._cut  # what a broker sent before its end is not held

    # Brokers that come and go

    def add(self, engine: SimulatedEngine) -> None:
        """Connect an engine with all others."""
        others = self.engines
        self._engines[engine.number] = engine
        for other in others:
            for one, two in ((engine, other), (other, engine)):
                path = self._paths[one.number, two.number] = _Path(self, one, two)
                path.closed = self.separated(path)
                if not path.closed:
                    one.announce(path)

    def remove(self, engine: SimulatedEngine, *, silent: bool = False) -> None:
        """Disconnect an engine: others notice at once, or when its lease has ended."""
        engine.alive = False
        del self._engines[engine.number]
        for path in self.paths(engine):
            back = self._paths.pop((path.target.number, engine.number))
            back.close()
            del self._paths[engine.number, path.target.number]
            if silent or path.closed:  # the other one may not have noticed a separation
                at = self.loop.time() + LEASE_SEC + self._random.random()
                self.loop.call_at(at, self._forget_at, path.target, engine, context=_KERNEL)
            else:
                self._forget_in_order(path)

    def _forget_in_order(self, path: _Path) -> None:
        source, target = path.source, path.target
        path.send(lambda: target.forget(source), declares=True)

    def _forget_at(self, target: SimulatedEngine, other: SimulatedEngine) -> None:
        """Tell an engine that the tokens of another have gone."""
        self.loop.call_soon(target.run, lambda: target.forget(other), context=target.context)

    def kill(self, place: str, *, silent: bool) -> None:
        """End the engine of a host without a word."""
        for engine in self.engines:
            if engine.place == place:
                self.remove(engine, silent=silent)

    # Faults

    def lose_route(self, one: str, two: str) -> None:
        """Lose what is on its way between two brokers."""
        for path in tuple(self._paths.values()):
            if {path.source.place, path.target.place} == {one, two}:
                path.lose()

    def flap(self, one: str, two: str) -> None:
        """Let one broker see the tokens of another go and come again."""
        for path in self._between(frozenset((one, two))):
            if path.source.place == one and not path.closed and not self.separated(path):
                self._forget_in_order(path)
                path.source.announce(path)

    def cut(self, one: str, two: str) -> None:
        """Separate two brokers until `join`."""
        pair = frozenset((one, two))
        if pair not in self._cut:
            separation = self._cut[pair] = object()
            for path in self._between(pair):
                at = self.loop.time() + LEASE_SEC + self._random.random()
                self.loop.call_at(at, self._expire, path, pair, separation, context=_KERNEL)

    def _between(self, pair: frozenset[str]) -> list[_Path]:
        return [path for path in self._paths.values() if {path.source.place, path.target.place} == pair]

    def _expire(self, path: _Path, pair: frozenset[str], separation: object) -> None:
        """The target of a path has not heard from its source for a lease."""
        if self._cut.get(pair) is separation and not path.closed:
            path.close()
            self._forget_at(path.target, path.source)

    def heal(self) -> None:
        """End all separations."""
        cut = tuple(self._cut)
        self._cut.clear()
        for pair in cut:
            paths = self._between(pair)
            if not any(path.closed for path in paths):
                for path in paths:
                    path.arrive()
                continue
            for path in paths:
                # One side may never notice: its session was renewed before its lease had ended.
                if not path.closed and self._random.random() < 0.7:
                    self._forget_at(path.target, path.source)
                path.close()
            for path in paths:
                after = self._random.choice([0.0, 0.01, 0.5, 2.0])
                self.loop.call_later(after, self._reconnect, path, context=_KERNEL)

    def _reconnect(self, path: _Path) -> None:
        known = self._paths.get((path.source.number, path.target.number)) is path
        if known and path.closed and not self.separated(path):
            path.source.announce(path)
