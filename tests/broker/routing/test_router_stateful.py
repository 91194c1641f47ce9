"""The router against a simple model: any frames, of several peers, in any order."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from broker.serving.stats import collect
from proto.wire import frames
from proto.wire.codes import Status
from proto.wire.frames import ReplyEntry, RequestEntry
from tests.broker import frame_makers as make
from tests.broker.switch import Switch
from tests.seams.structure import of_router

TOPICS = ("/red", "/green")
SERVICES = ("/add", "/sub")
KINDS = ("publisher", "subscription", "client", "server")
HASHES = (make.HASH, make.HASH, "RIHS01_bb", None)
"""None: a raw subscription."""

MIN_PEERS, MAX_PEERS = 2, 6
PICK = st.integers(0, 1000)


@dataclass(eq=False)
class PeerModel:
    """A link, as its client knows it."""

    number: int
    suspended: bool = False
    ids: int = 0
    attached: set[tuple[int, int]] = field(default_factory=set)
    """Publishers and the subscriptions that hear them."""
    received: Counter[int] = field(default_factory=Counter)
    """By publisher, the number that must come next, or a later one."""
    matched: Counter[int] = field(default_factory=Counter)
    """By endpoint, the count that the last MATCHED gave."""
    endpoints: list[EndpointModel] = field(default_factory=list)


@dataclass(eq=False)
class EndpointModel:
    """Something that a peer has declared. `pending`: a server's calls, or what a client waits for."""

    peer: PeerModel
    id: int
    kind: str
    name: str
    type_hash: str | None
    key: int = 0
    sequence: int = 0
    calls: int = 0
    pending: dict[int, bytes] = field(default_factory=dict)
    declared: bool = True

    @property
    def there(self) -> bool:
        """Whether others can be matched with it."""
        return self.declared and not self.peer.suspended

    def matches(self, other: EndpointModel) -> bool:
        """Whether the two are counterparts."""
        kinds = {self.kind, other.kind}
        fits = self.type_hash == other.type_hash or (self.type_hash is None and self.kind == "subscription")
        fits = fits or (other.type_hash is None and other.kind == "subscription")
        pairs = ({"publisher", "subscription"}, {"client", "server"})
        return kinds in pairs and self.name == other.name and fits and self.there and other.there


class Routing(RuleBasedStateMachine):
    """Peers come, declare, publish, call, answer, freeze, read, and go."""

    def __init__(self) -> None:
        super().__init__()
        self.switch = Switch()
        self.all: list[PeerModel] = []
        self.published = 0
        for kind in KINDS:
            self.join()
            self._declare(self.all[-1], kind, 0, make.HASH)

    def _peer(self, pick: int) -> PeerModel:
        return self.all[pick % len(self.all)]

    def _one(self, pick: int, *kinds: str) -> EndpointModel | None:
        """Pick an endpoint of these kinds, if there is one."""
        there = [endpoint for peer in self.all for endpoint in peer.endpoints if endpoint.kind in kinds]
        return there[pick % len(there)] if there else None

    # Who is there

    @rule()
    def join(self) -> None:
        if len(self.all) < MAX_PEERS:
            self.all.append(PeerModel(self.switch.join(f"/node{self.switch.hellos}")))

    @rule(pick=PICK)
    def leave(self, pick: int) -> None:
        if len(self.all) <= MIN_PEERS:
            return
        peer = self._peer(pick)
        self._hear(peer)
        self.all.remove(peer)
        for endpoint in peer.endpoints:
            endpoint.declared = False
        self.switch.leave(peer.number)

    @rule(pick=PICK)
    def freeze(self, pick: int) -> None:
        peer = self._peer(pick)
        peer.suspended = True
        self.switch.suspend(peer.number)

    @rule(pick=PICK)
    def thaw(self, pick: int) -> None:
        self._thaw(self._peer(pick))

    def _thaw(self, peer: PeerModel) -> None:
        peer.suspended = False
        self.switch.restore(peer.number)

    def _send(self, peer: PeerModel, frame: frames.Frame) -> None:
        """Let a peer send a frame: a sign of life, as any bytes are."""
        if peer.suspended:
            self._thaw(peer)
        self.switch.send(peer.number, frame)

    @rule(
        pick=PICK,
        kind=st.sampled_from(KINDS),
        where=st.integers(0, 1),
        type_hash=st.sampled_from(HASHES),
        qos=st.builds(dict, depth=st.integers(1, 5), durability=st.integers(1, 2)),
    )
    def declare(self, pick: int, kind: str, where: int, type_hash: str | None, qos: frames.Options) -> None:
        if kind == "subscription" or type_hash is not None:
            self._declare(self._peer(pick), kind, where, type_hash, qos)

    def _declare(
        self, peer: PeerModel, kind: str, where: int, type_hash: str | None, qos: frames.Options | None = None
    ) -> None:
        peer.ids += 1
        name = (TOPICS if kind in {"publisher", "subscription"} else SERVICES)[where]
        peer.endpoints.append(EndpointModel(peer, peer.ids, kind, name, type_hash))
        gid = peer.number.to_bytes(8, "big") + peer.ids.to_bytes(8, "big")
        declaration: frames.Frame
        if kind == "publisher":
            declaration = make.publisher(peer.ids, name, qos=qos, type_hash=type_hash or "")
            declaration = declaration._replace(gid=gid)
        elif kind == "subscription":
            declaration = make.subscription(peer.ids, name, qos=qos, raw=type_hash is None)
            declaration = declaration._replace(type_hash=type_hash)
        elif kind == "client":
            declaration = make.client(peer.ids, name, type_hash=type_hash or "")
        else:
            declaration = make.service(peer.ids, name, type_hash=type_hash or "")
        self._send(peer, declaration)
        self._hear(peer)

    @rule(pick=PICK, kind=st.sampled_from(KINDS))
    def undeclare(self, pick: int, kind: str) -> None:
        endpoint = self._one(pick, kind)
        if endpoint is not None:
            self._hear(endpoint.peer)
            endpoint.declared = False
            endpoint.peer.endpoints.remove(endpoint)
            self._send(endpoint.peer, frames.Undeclare(endpoint.id))

    # Messages

    @rule(pick=PICK, length=st.integers(1, 7), gap=st.integers(-3, 3))
    def publish(self, pick: int, length: int, gap: int) -> None:
        endpoint = self._one(pick, "publisher")
        if endpoint is not None:
            first = max(0, endpoint.sequence + gap)
            self._send(endpoint.peer, make.batch(endpoint.key, first, length))
            self.published += length
            endpoint.sequence = max(endpoint.sequence, first + length)

    @rule(pick=PICK)
    def congest(self, pick: int) -> None:
        self.switch.congest(self._peer(pick).number)

    @rule(pick=PICK, pieces=st.integers(1, 20))
    def hear(self, pick: int, pieces: int) -> None:
        peer = self._peer(pick)
        self._take(peer, self.switch.read_all(peer.number, pieces))

    def _hear(self, peer: PeerModel) -> None:
        self._take(peer, self.switch.read_all(peer.number))

    def _take(self, peer: PeerModel, received: list[frames.Frame]) -> None:
        for frame in received:
            match frame:
                case frames.Accepted():
                    self._endpoint(peer, frame.id).key = frame.number
                case frames.Matched():
                    peer.matched[frame.id] = frame.peers
                case frames.Attached() | frames.Detached():
                    self._take_attachment(peer, frame)
                case frames.Batch():
                    self._take_batch(peer, frame)
                case frames.Request() | frames.Cancel():
                    self._take_requests(peer, frame)
                case frames.Reply():
                    self._take_replies(peer, frame)
                case _:
                    pass

    def _take_attachment(self, peer: PeerModel, frame: frames.Attached | frames.Detached) -> None:
        for reader in frame.subscriptions:
            if isinstance(frame, frames.Attached):
                peer.attached.add((frame.publisher, reader))
            else:
                peer.attached.discard((frame.publisher, reader))

    def _endpoint(self, peer: PeerModel, number: int) -> EndpointModel:
        return next(endpoint for endpoint in peer.endpoints if endpoint.id == number)

    def _take_batch(self, peer: PeerModel, batch: frames.Batch) -> None:
        assert any(publisher == batch.publisher for publisher, _ in peer.attached), (
            "a batch without a subscription"
        )
        assert batch.first_sequence >= peer.received[batch.publisher], "out of order, or twice"
        peer.received[batch.publisher] = batch.first_sequence + batch.length

    # Calls

    @rule(pick=PICK, count=st.integers(1, 3))
    def call(self, pick: int, count: int) -> None:
        endpoint = self._one(pick, "client")
        if endpoint is None:
            return
        entries = []
        for _ in range(count):
            endpoint.calls += 1
            body = f"{endpoint.peer.number} {endpoint.id} {endpoint.calls}".encode()
            endpoint.pending[endpoint.calls] = body
            entries.append(RequestEntry(endpoint.calls, None, None, body))
        self._send(endpoint.peer, frames.Request(endpoint.id, tuple(entries)))

    def _take_requests(self, peer: PeerModel, frame: frames.Request | frames.Cancel) -> None:
        server = self._endpoint(peer, frame.endpoint)
        if isinstance(frame, frames.Cancel):
            for call in frame.calls:
                server.pending.pop(call, None)
            return
        for entry in frame.entries:
            assert entry.call not in server.pending, "a request came twice"
            server.pending[entry.call] = entry.body

    @rule(pick=PICK, owners=PICK)
    def answer(self, pick: int, owners: int) -> None:
        """A server answers all that it, or another one, has been asked."""
        endpoint, owner = self._one(pick, "server"), self._one(owners, "server")
        if endpoint is None or owner is None:
            return
        self._hear(owner.peer)
        bodies = {call: body if owner is endpoint else b"not mine" for call, body in owner.pending.items()}
        entries = tuple(ReplyEntry(call, 0, False, None, body) for call, body in bodies.items())
        if owner is endpoint:
            endpoint.pending.clear()
        if entries:
            self._send(endpoint.peer, frames.Reply(endpoint.id, entries))

    def _take_replies(self, peer: PeerModel, frame: frames.Reply) -> None:
        client = self._endpoint(peer, frame.endpoint)
        for entry in frame.entries:
            asked = client.pending.pop(entry.call, None)
            assert asked is not None, "a reply that nobody waits for"
            assert entry.status == Status.UNAVAILABLE or entry.body == asked, "somebody else's reply"

    @rule(pick=PICK)
    def cancel(self, pick: int) -> None:
        endpoint = self._one(pick, "client")
        if endpoint is not None and endpoint.pending:
            self._hear(endpoint.peer)
            calls = tuple(endpoint.pending)
            endpoint.pending.clear()
            if calls:
                self._send(endpoint.peer, frames.Cancel(endpoint.id, calls))

    # What must hold

    @invariant()
    def everything_adds_up(self) -> None:
        stats = collect(0, [self.switch.router])
        assert stats.copies == stats.accounted
        assert self.published == stats.routed + stats.unmatched + stats.stale
        assert not list(of_router(self.switch.router))
        assert not self.switch.closed

    @rule()
    def everybody_knows_their_counterparts(self) -> None:
        """Once all has been read: the number of counterparts, and who is attached to whom."""
        for peer in self.all:
            self._hear(peer)
        there = [endpoint for peer in self.all for endpoint in peer.endpoints]
        for endpoint in there:
            counterparts = [other for other in there if endpoint.matches(other)]
            assert endpoint.peer.matched[endpoint.id] == len(counterparts)
            if endpoint.kind == "subscription":
                publishers = {
                    publisher for publisher, reader in endpoint.peer.attached if reader == endpoint.id
                }
                assert publishers == {other.key for other in counterparts}

    @rule()
    def every_call_is_somewhere(self) -> None:
        """Once all has been read: a client waits for exactly what servers have still to answer."""
        for peer in self.all:
            self._hear(peer)
        there = [endpoint for peer in self.all for endpoint in peer.endpoints]
        waits = Counter(body for each in there if each.kind == "client" for body in each.pending.values())
        owed = Counter(
            body for each in there if each.kind == "server" and each.there for body in each.pending.values()
        )
        assert waits <= owed, "a call that nobody will answer"
        assert max(waits.values(), default=1) == 1

    def teardown(self) -> None:
        """Without peers the router holds nothing."""
        for peer in tuple(self.all):
            self.switch.leave(peer.number)
        self.all.clear()
        self.everything_adds_up()
        router = self.switch.router
        assert not router.relied_on
        for part in (
            router,
            router.declarations,
            router.routes,
            router.topics,
            router.services,
            router.graph,
        ):
            held = {
                name: value for name, value in vars(part).items() if isinstance(value, dict | set) and value
            }
            assert set(held) <= {"_handlers"}, held
        super().teardown()


TestRouting = Routing.TestCase
