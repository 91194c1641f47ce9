"""The frames of the protocol, one NamedTuple each (docs/protocol.md §4 to §8).

A frame's header on the wire is a msgpack array: the opcode, then the fields in the order given here. `SPECS`
is the whole grammar as data: the codec checks every header against it and knows nothing else about a frame.
Fields with a default were added later: an older peer sends a header without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from proto.wire.codes import Op
from proto.wire.mesh_keys import broker_of_key

if TYPE_CHECKING:
    from proto.wire.stats import LinkStats, MeshBrokerStats, TopicStats

Buffer: TypeAlias = bytes | bytearray | memoryview
Scalar: TypeAlias = str | bytes | int | float | bool | None
Options: TypeAlias = Mapping[str, Scalar]
"""A flat map: text keys, scalar values. Unknown keys are ignored."""


class RequestEntry(NamedTuple):
    """One call for a server. `remaining_ms` is None for a call without a deadline."""

    call: int
    remaining_ms: int | None
    attributes: Options | None
    body: bytes


class ReplyEntry(NamedTuple):
    """The end of one call. `more` is reserved for streamed replies and must be false."""

    call: int
    status: int
    more: bool
    attributes: Options | None
    body: bytes


class GraphEntry(NamedTuple):
    """One node or endpoint in the graph.

    `key` is chosen by its broker and never reused while that runs. `qos` of a node: `shared`, if it is, and
    its labels (`labels.py`).
    """

    key: int
    kind: int
    node: str
    name: str
    type_name: str
    type_hash: str
    qos: Options

    @property
    def broker(self) -> int:
        """The number of its broker in the mesh; 0 without a mesh."""
        return broker_of_key(self.key)


class Hello(NamedTuple):
    """First frame of a client."""

    version: int
    options: Options


class Welcome(NamedTuple):
    """The broker's answer to HELLO: the session is open."""

    version: int
    options: Options


class Error(NamedTuple):
    """The sender closes the connection now, for this reason."""

    code: int
    text: str


class Goodbye(NamedTuple):
    """The sender has finished the work it accepted and will close."""

    text: str


class Ping(NamedTuple):
    """Requests a PONG with the same token, after everything sent before has been handled."""

    token: int


class Pong(NamedTuple):
    """Answers a PING."""

    token: int


class Node(NamedTuple):
    """Declares a node under its full name.

    `shared`: other nodes that declare the same may have the name, too (§5.2.2). `labels`: strings by name,
    for users and tools (§5.2.4). `apart`: endpoints of nodes with the same text do not match (§5.4.5).
    `yields`: a node that does not share its name takes this one's (§5.2.5).
    """

    id: int
    name: str
    shared: bool = False
    labels: Options = {}  # noqa: RUF012
    apart: str = ""
    yields: bool = False


class Publisher(NamedTuple):
    """Declares a publisher. Its `gid` is the same on each link; `next_sequence` continues its numbers.

    Messages from `live_sequence` on are sent for the first time; those below it are latched messages that are
    sent again. If it is not above `next_sequence`, there are none of the latter.
    """

    id: int
    node: int
    topic: str
    type_name: str
    type_hash: str
    qos: Options
    gid: bytes
    next_sequence: int
    definition: bytes | None
    live_sequence: int = 0


class Subscription(NamedTuple):
    """Declares a subscription. Without a type (raw) it matches all types. Windows are its first credit.

    `stall_ms`: how long it may hold publishers back without a GRANT; 0 is the broker's limit (§6.5.9).
    """

    id: int
    node: int
    topic: str
    type_name: str | None
    type_hash: str | None
    qos: Options
    window_messages: int
    window_bytes: int
    stall_ms: int = 0


class Service(NamedTuple):
    """Declares a server of a service."""

    id: int
    node: int
    name: str
    type_name: str
    type_hash: str
    definition: bytes | None


class Client(NamedTuple):
    """Declares a client of a service."""

    id: int
    node: int
    name: str
    type_name: str
    type_hash: str


class Undeclare(NamedTuple):
    """Removes an endpoint, or a node with its endpoints."""

    id: int


class Retire(NamedTuple):
    """A server takes no more requests but may answer those it has. Its UNDECLARE follows."""

    id: int


class Accepted(NamedTuple):
    """The declaration is accepted. `number` is a publisher's broker-wide id, and 0 for all else."""

    id: int
    number: int


class Refused(NamedTuple):
    """The declaration is refused."""

    id: int
    code: int
    text: str


class Matched(NamedTuple):
    """The number of counterparts that an endpoint has now, and the total since its declaration."""

    id: int
    peers: int
    total: int


class Attached(NamedTuple):
    """From `first_sequence` on, the publisher's batches are also for these subscriptions of this link.

    `gid` is the publisher's public one (§6.3.4), `qos` the publisher's.
    """

    publisher: int
    subscriptions: tuple[int, ...]
    gid: bytes
    first_sequence: int
    node: str
    qos: Options


class Detached(NamedTuple):
    """Further batches of this publisher are not for these subscriptions."""

    publisher: int
    subscriptions: tuple[int, ...]
    reason: int


class Notice(NamedTuple):
    """A warning about a declared endpoint.

    `policy`: the last incompatible QoS policy, or 0. `peers`: the number of counterparts concerned.
    """

    id: int
    kind: int
    text: str
    policy: int
    peers: int


class Batch(NamedTuple):
    """Consecutive messages of one publisher.

    `payload` is a msgpack `array 32` of `length` messages; `ends` holds the end offset of each message in it,
    counted after the five-byte array head, as little-endian u32 (None for a single message). `raw` is the
    whole encoded frame, if there is one, which can be forwarded unchanged.
    """

    publisher: int
    first_sequence: int
    stamp_ns: int
    length: int
    ends: bytes | None
    attributes: Options | None
    payload: Buffer
    raw: Buffer


class Replay(NamedTuple):
    """Latched messages for one subscription that attached late."""

    subscription: int
    publisher: int
    first_sequence: int
    stamp_ns: int
    length: int
    ends: bytes | None
    attributes: Options | None
    payload: Buffer


class Fragment(NamedTuple):
    """A part of a frame that exceeds the frame size limit; the first one has the total size."""

    transfer: int
    total: int | None
    more: bool
    payload: Buffer


class Abort(NamedTuple):
    """The sender gives this transfer up."""

    transfer: int


class Grant(NamedTuple):
    """A KEEP_ALL subscription's credit for a publisher.

    `sequence_limit`: messages with smaller numbers may be sent. `byte_limit`: bytes since the attachment.
    """

    subscription: int
    publisher: int
    sequence_limit: int
    byte_limit: int


class Credit(NamedTuple):
    """A publisher's credit: the minimum over its KEEP_ALL subscriptions; None is unlimited.

    `sequence_limit`: messages with smaller numbers may be sent (§6.5.4 on gaps). `byte_limit`: bytes since
    the declaration. The client echoes a CREDIT that ends unlimited credit; the broker enforces the limit from
    the echo on.
    """

    publisher: int
    sequence_limit: int | None
    byte_limit: int | None


class Assert(NamedTuple):
    """A MANUAL_BY_TOPIC publisher asserts that it is alive, without a message."""

    publisher: int


class Request(NamedTuple):
    """Requests from a client, or to a server."""

    endpoint: int
    entries: tuple[RequestEntry, ...]


class Reply(NamedTuple):
    """Replies from a server, or to a client; each ends its call."""

    endpoint: int
    entries: tuple[ReplyEntry, ...]


class Cancel(NamedTuple):
    """These calls are no longer wanted."""

    endpoint: int
    calls: tuple[int, ...]


class Watch(NamedTuple):
    """Requests the graph: once, or (`keep`) with all later changes."""

    id: int
    keep: bool


class Unwatch(NamedTuple):
    """Ends a kept watch."""

    id: int


class Graph(NamedTuple):
    """A part of the graph, or a change. `more`: the initial snapshot continues in the next GRAPH frame.

    `suspended`: those of `removed` whose link is only silent; they may return under the same key.
    """

    watch: int
    more: bool
    added: tuple[GraphEntry, ...]
    removed: tuple[int, ...]
    suspended: tuple[int, ...]


class Describe(NamedTuple):
    """Requests the type definition with this hash."""

    type_hash: str


class Definition(NamedTuple):
    """Answers DESCRIBE; None if the broker does not know the hash."""

    type_hash: str
    definition: bytes | None


class Inspect(NamedTuple):
    """Requests the broker's statistics."""

    id: int


class Stats(NamedTuple):
    """A part of the broker's statistics; the first has `totals` and `mesh`. `more`: another one follows."""

    id: int
    more: bool
    totals: Options
    topics: tuple[TopicStats, ...]
    links: tuple[LinkStats, ...]
    brokers: tuple[MeshBrokerStats, ...] = ()
    mesh: Options = {}  # noqa: RUF012


class Arena(NamedTuple):
    """Shared memory in which messages of the sender, or (from a broker) of another client, will be.

    It is the file `descriptor` of the process `process`, sealed, of `size` bytes, and begins with `token`.
    """

    id: int
    process: int
    descriptor: int
    size: int
    token: bytes


class Mapped(NamedTuple):
    """The sender has mapped an arena, or (`problem` is not empty) could not."""

    id: int
    problem: str


class Unmap(NamedTuple):
    """No further REFERENCE is to this arena."""

    id: int


class Reference(NamedTuple):
    """A BATCH whose messages are in an arena (§6.10).

    Their slot begins at `offset` with `generation`; they are the `size` bytes that begin `start` bytes later.
    """

    publisher: int
    first_sequence: int
    stamp_ns: int
    length: int
    ends: bytes | None
    attributes: Options | None
    arena: int
    offset: int
    start: int
    size: int
    generation: int


class Release(NamedTuple):
    """The sender does not need these slots any more. REFERENCE frames are numbered from 0 on a link."""

    numbers: tuple[int, ...]


class Proof(NamedTuple):
    """The sender can read files of the broker's user: it knows the broker's secret (§6.10.2)."""

    proof: bytes


SessionFrame: TypeAlias = Hello | Welcome | Error | Goodbye | Ping | Pong
Declaration: TypeAlias = Node | Publisher | Subscription | Service | Client | Undeclare | Retire
DeclarationEvent: TypeAlias = Accepted | Refused | Matched | Attached | Detached | Notice
MessageFrame: TypeAlias = Batch | Replay | Fragment | Abort | Grant | Credit | Assert
CallFrame: TypeAlias = Request | Reply | Cancel
QueryFrame: TypeAlias = Watch | Unwatch | Graph | Describe | Definition | Inspect | Stats
SharedMemoryFrame: TypeAlias = Arena | Mapped | Unmap | Reference | Release | Proof
Frame: TypeAlias = (
    SessionFrame | Declaration | DeclarationEvent | MessageFrame | CallFrame | QueryFrame | SharedMemoryFrame
)


class Spec(NamedTuple):
    """The grammar of one frame: its class, and the kind of each header field (see field_kinds.KINDS)."""

    frame: Callable[..., Any]
    kinds: tuple[str, ...]
    has_payload: bool = False


SPECS: Mapping[int, Spec] = {
    Op.HELLO: Spec(Hello, ("u32", "map")),
    Op.WELCOME: Spec(Welcome, ("u32", "map")),
    Op.ERROR: Spec(Error, ("u32", "str")),
    Op.GOODBYE: Spec(Goodbye, ("str",)),
    Op.PING: Spec(Ping, ("u64",)),
    Op.PONG: Spec(Pong, ("u64",)),
    Op.NODE: Spec(Node, ("u32", "str", "bool", "map", "str", "bool")),
    Op.PUBLISHER: Spec(
        Publisher, ("u32", "u32", "str", "str", "str", "map", "bin16", "u64", "definition?", "u64")
    ),
    Op.SUBSCRIPTION: Spec(Subscription, ("u32", "u32", "str", "str?", "str?", "map", "u64", "u64", "u32")),
    Op.SERVICE: Spec(Service, ("u32", "u32", "str", "str", "str", "definition?")),
    Op.CLIENT: Spec(Client, ("u32", "u32", "str", "str", "str")),
    Op.UNDECLARE: Spec(Undeclare, ("u32",)),
    Op.RETIRE: Spec(Retire, ("u32",)),
    Op.ACCEPTED: Spec(Accepted, ("u32", "u64")),
    Op.REFUSED: Spec(Refused, ("u32", "u32", "str")),
    Op.MATCHED: Spec(Matched, ("u32", "u32", "u64")),
    Op.ATTACHED: Spec(Attached, ("u64", "u32s", "bin16", "u64", "str", "map")),
    Op.DETACHED: Spec(Detached, ("u64", "u32s", "u32")),
    Op.NOTICE: Spec(Notice, ("u32", "u32", "str", "u32", "u32")),
    Op.BATCH: Spec(Batch, ("u64", "u64", "u64", "length", "bin?", "attributes?"), has_payload=True),
    Op.REPLAY: Spec(Replay, ("u32", "u64", "u64", "u64", "length", "bin?", "attributes?"), has_payload=True),
    Op.FRAGMENT: Spec(Fragment, ("u32", "u32?", "bool"), has_payload=True),
    Op.ABORT: Spec(Abort, ("u32",)),
    Op.GRANT: Spec(Grant, ("u32", "u64", "u64", "u64")),
    Op.CREDIT: Spec(Credit, ("u64", "u64?", "u64?")),
    Op.ASSERT: Spec(Assert, ("u64",)),
    Op.REQUEST: Spec(Request, ("u32", "requests")),
    Op.REPLY: Spec(Reply, ("u32", "replies")),
    Op.CANCEL: Spec(Cancel, ("u32", "u64s")),
    Op.WATCH: Spec(Watch, ("u32", "bool")),
    Op.UNWATCH: Spec(Unwatch, ("u32",)),
    Op.GRAPH: Spec(Graph, ("u32", "bool", "graph", "u64s", "u64s")),
    Op.DESCRIBE: Spec(Describe, ("str",)),
    Op.DEFINITION: Spec(Definition, ("str", "definition?")),
    Op.INSPECT: Spec(Inspect, ("u32",)),
    Op.STATS: Spec(Stats, ("u32", "bool", "map", "topics", "links", "brokers", "map")),
    Op.ARENA: Spec(Arena, ("u32", "u32", "u32", "u64", "bin16")),
    Op.MAPPED: Spec(Mapped, ("u32", "str")),
    Op.UNMAP: Spec(Unmap, ("u32",)),
    Op.REFERENCE: Spec(
        Reference,
        ("u64", "u64", "u64", "length", "bin?", "attributes?", "u32", "u64", "u64", "u64", "u64"),
    ),
    Op.RELEASE: Spec(Release, ("u64s",)),
    Op.PROOF: Spec(Proof, ("bin16",)),
}

OPCODES: Mapping[type, int] = {spec.frame: op for op, spec in SPECS.items() if isinstance(spec.frame, type)}
