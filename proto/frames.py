"""What is said on the wire: one NamedTuple per frame (docs/protocol.md §4 to §8).

A frame's header on the wire is a msgpack array: the opcode, then the fields in the order given here. `SPECS`
is the whole grammar as data: the codec checks every header against it and knows nothing else about a frame.
Fields with a default came later than the others: a peer that does not know them sends a header without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from proto.codes import Op

if TYPE_CHECKING:
    from proto.stats import LinkStats, TopicStats

Buffer: TypeAlias = bytes | bytearray | memoryview
Scalar: TypeAlias = str | bytes | int | float | bool | None
Options: TypeAlias = Mapping[str, Scalar]
"""A flat map: text keys, scalar values. Unknown keys are ignored."""


class RequestEntry(NamedTuple):
    """One call on its way to a server. `remaining_ms` is None for a call without a deadline."""

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
    """One node or endpoint, as everybody sees it. `key` is the broker's and never reused while it lives."""

    key: int
    kind: int
    node: str
    name: str
    type_name: str
    type_hash: str
    qos: Options


class Hello(NamedTuple):
    """First frame of a client."""

    version: int
    options: Options


class Welcome(NamedTuple):
    """The broker's answer to HELLO: the session is open."""

    version: int
    options: Options


class Error(NamedTuple):
    """Why the sender closes the connection now."""

    code: int
    text: str


class Goodbye(NamedTuple):
    """The sender will finish what it has accepted and close."""

    text: str


class Ping(NamedTuple):
    """Asks for a PONG with the same token, after everything sent before."""

    token: int


class Pong(NamedTuple):
    """Answers a PING."""

    token: int


class Node(NamedTuple):
    """Declares a node under its full name."""

    id: int
    name: str


class Publisher(NamedTuple):
    """Declares a publisher. `gid` names it for good; `next_sequence` goes on where an earlier link ended.

    Messages from `live_sequence` on are sent for the first time; those below are latched ones, sent again.
    One that is not above `next_sequence` means that there are none of these.
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
    """Declares a subscription. Without a type (raw) it matches every type. Windows are its first credit."""

    id: int
    node: int
    topic: str
    type_name: str | None
    type_hash: str | None
    qos: Options
    window_messages: int
    window_bytes: int


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
    """Takes an endpoint, or a node with its endpoints, back."""

    id: int


class Retire(NamedTuple):
    """A server takes no more requests; those it has it may still answer. Its UNDECLARE follows."""

    id: int


class Accepted(NamedTuple):
    """The declaration stands. `number` is a publisher's broker-wide id, 0 for the rest."""

    id: int
    number: int


class Refused(NamedTuple):
    """The declaration does not stand."""

    id: int
    code: int
    text: str


class Matched(NamedTuple):
    """How many counterparts the endpoint has now, and how many it has had in all since its declaration."""

    id: int
    peers: int
    total: int


class Attached(NamedTuple):
    """From `first_sequence` on, the publisher's runs are for these subscriptions of this link, too.

    `qos` is the publisher's.
    """

    publisher: int
    subscriptions: tuple[int, ...]
    gid: bytes
    first_sequence: int
    node: str
    qos: Options


class Detached(NamedTuple):
    """No more runs of this publisher for these subscriptions."""

    publisher: int
    subscriptions: tuple[int, ...]
    reason: int


class Notice(NamedTuple):
    """A warning about a declared endpoint.

    `policy`: the number of the last QoS policy that does not fit, or 0. `peers`: how many counterparts it is
    about.
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
    whole encoded frame when there is one: what can be forwarded byte for byte.
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
    """Latched messages for one subscription that came late: a run with an address."""

    subscription: int
    publisher: int
    first_sequence: int
    stamp_ns: int
    length: int
    ends: bytes | None
    attributes: Options | None
    payload: Buffer


class Fragment(NamedTuple):
    """A piece of a frame that is larger than a frame may be; the first one says the total."""

    transfer: int
    total: int | None
    more: bool
    payload: Buffer


class Abort(NamedTuple):
    """The rest of this transfer will not come."""

    transfer: int


class Grant(NamedTuple):
    """A KEEP_ALL subscription's credit for a publisher.

    `sequence_limit`: messages below it may come. `byte_limit`: bytes since the attachment.
    """

    subscription: int
    publisher: int
    sequence_limit: int
    byte_limit: int


class Credit(NamedTuple):
    """A publisher's credit: the least over its KEEP_ALL subscriptions; None is unlimited.

    `sequence_limit`: messages below it may be sent (§6.5.4 on gaps). `byte_limit`: bytes since the
    declaration. The client echoes a CREDIT that ends an unlimited time: from then on the broker holds it to
    the limit.
    """

    publisher: int
    sequence_limit: int | None
    byte_limit: int | None


class Assert(NamedTuple):
    """A MANUAL_BY_TOPIC publisher is alive, although it has nothing to say."""

    publisher: int


class Request(NamedTuple):
    """Calls from a client, or to a server."""

    endpoint: int
    entries: tuple[RequestEntry, ...]


class Reply(NamedTuple):
    """Ends of calls, from a server or to a client."""

    endpoint: int
    entries: tuple[ReplyEntry, ...]


class Cancel(NamedTuple):
    """These calls are no longer wanted."""

    endpoint: int
    calls: tuple[int, ...]


class Watch(NamedTuple):
    """Asks for the graph: once, or (`keep`) with every change that follows."""

    id: int
    keep: bool


class Unwatch(NamedTuple):
    """Ends a kept watch."""

    id: int


class Graph(NamedTuple):
    """A piece of the graph, or a change. `more`: the first picture goes on in the next GRAPH frame.

    `suspended`: those of `removed` that are only silent, and may come back under the same key.
    """

    watch: int
    more: bool
    added: tuple[GraphEntry, ...]
    removed: tuple[int, ...]
    suspended: tuple[int, ...]


class Describe(NamedTuple):
    """Asks for the definition behind a type hash."""

    type_hash: str


class Definition(NamedTuple):
    """Answers DESCRIBE; None where the broker has not seen that hash."""

    type_hash: str
    definition: bytes | None


class Inspect(NamedTuple):
    """Asks for the broker's numbers."""

    id: int


class Stats(NamedTuple):
    """A piece of the broker's numbers, `totals` in the first. `more`: they go on in the next STATS frame."""

    id: int
    more: bool
    totals: Options
    topics: tuple[TopicStats, ...]
    links: tuple[LinkStats, ...]


Frame: TypeAlias = (
    Hello
    | Welcome
    | Error
    | Goodbye
    | Ping
    | Pong
    | Node
    | Publisher
    | Subscription
    | Service
    | Client
    | Undeclare
    | Retire
    | Accepted
    | Refused
    | Matched
    | Attached
    | Detached
    | Notice
    | Batch
    | Replay
    | Fragment
    | Abort
    | Grant
    | Credit
    | Assert
    | Request
    | Reply
    | Cancel
    | Watch
    | Unwatch
    | Graph
    | Describe
    | Definition
    | Inspect
    | Stats
)


class Spec(NamedTuple):
    """One line of the grammar: the frame's class, and the kind of each header field (see codec.KINDS)."""

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
    Op.NODE: Spec(Node, ("u32", "str")),
    Op.PUBLISHER: Spec(
        Publisher, ("u32", "u32", "str", "str", "str", "map", "bin16", "u64", "definition?", "u64")
    ),
    Op.SUBSCRIPTION: Spec(Subscription, ("u32", "u32", "str", "str?", "str?", "map", "u64", "u64")),
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
    Op.BATCH: Spec(Batch, ("u64", "u64", "u64", "length", "bin?", "map?"), has_payload=True),
    Op.REPLAY: Spec(Replay, ("u32", "u64", "u64", "u64", "length", "bin?", "map?"), has_payload=True),
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
    Op.STATS: Spec(Stats, ("u32", "bool", "map", "topics", "links")),
}

OPCODES: Mapping[type, int] = {spec.frame: op for op, spec in SPECS.items() if isinstance(spec.frame, type)}
