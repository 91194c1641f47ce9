"""Encoding and decoding of frames (docs/protocol.md §3).

Every frame is a msgpack `bin 32`, so its size is known before it is buffered. Inside is a header (a msgpack
array of at most 15 fields whose first is the opcode, below 128) and then, for BATCH, REPLAY and FRAGMENT
only, the payload. For any input, `decode` either returns a frame whose fields have the types of `frames.py`
or raises ProtocolError.
"""

from __future__ import annotations

import operator
from functools import partial
from struct import Struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import msgpack

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire.codes import Op
from proto.wire.depth import MAX_DEPTH, check_depth
from proto.wire.ends import check_ends
from proto.wire.field_kinds import KINDS
from proto.wire.frames import (
    OPCODES,
    SPECS,
    Batch,
    Buffer,
    Fragment,
    Frame,
    Graph,
    GraphEntry,
    Options,
    Reference,
    Replay,
    Reply,
    ReplyEntry,
    Request,
    RequestEntry,
    Stats,
)
from proto.wire.stats import LinkStats, MeshBrokerStats, TopicStats

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from proto.wire.field_kinds import Check

BIN_32: Final = 0xC6
ARRAY_16: Final = 0xDC
ARRAY_32: Final = 0xDD
ARRAY_HEAD_BYTES: Final = 5

_FIXARRAY: Final = 0x90
_MAX_MARKER: Final = 0x9F
_prefix: Final = Struct(">BI").pack
_graph_head: Final = Struct(">BH").pack
_SHAPES: Final = {kind: (op, len(SPECS[op].kinds), SPECS[op].has_payload) for kind, op in OPCODES.items()}
_GRAPH_START: Final = bytes([_FIXARRAY + 1 + len(SPECS[Op.GRAPH].kinds), Op.GRAPH])
_pack = cast("Callable[[object], bytes]", msgpack.Packer(autoreset=True).pack)


def encode(frame: Frame) -> bytes:
    """Return the encoded frame, prefix included.

    A frame whose content exceeds `limits.MAX_FRAME_BYTES` must be sent in fragments (see fragments.py).
    """
    op, fields, has_payload = _SHAPES[type(frame)]
    header = _pack((op, *frame[:fields]))
    if has_payload:
        payload = cast("Buffer", frame[fields])
        return b"".join((_prefix(BIN_32, len(header) + len(payload)), header, payload))
    return _prefix(BIN_32, len(header)) + header


def encode_graph_entry(entry: GraphEntry) -> bytes:
    """Return an entry of the graph as it is encoded in GRAPH frames."""
    return _pack(entry)


def encode_graph_changes(added: Sequence[bytes], removed: Sequence[int], suspended: Sequence[int]) -> bytes:
    """Return the part of a GRAPH frame that is the same for all watches.

    Args:
        added: Encoded entries, at most 65,535.
        removed: Keys.
        suspended: Those of them that may come back.
    """
    return b"".join((_graph_head(ARRAY_16, len(added)), *added, _pack(removed), _pack(suspended)))


def encode_graph(watch: int, *, more: bool, changes: bytes) -> bytes:
    """Return a GRAPH frame, prefix included.

    Args:
        watch: The id of the watch.
        more: As in the frame.
        changes: What `encode_graph_changes` has returned.
    """
    header = b"".join((_GRAPH_START, _pack(watch), _pack(more), changes))
    return _prefix(BIN_32, len(header)) + header


def with_id(raw: bytes, number: int) -> bytes:
    """Return an encoded frame without a payload whose first field is the id 0, with another id."""
    start = limits.PREFIX_BYTES + 2
    header = b"".join((raw[limits.PREFIX_BYTES : start], _pack(number), raw[start + 1 :]))
    return _prefix(BIN_32, len(header)) + header


def encode_head(frame: Batch | Replay | Fragment) -> bytes:
    """Return the encoded frame up to its payload, which must follow on the wire."""
    op, fields, _ = _SHAPES[type(frame)]
    header = _pack((op, *frame[:fields]))
    return _prefix(BIN_32, len(header) + len(frame.payload)) + header


def batch_head(fields: tuple[int, int, int, int, bytes | None, Options | None], payload_bytes: int) -> bytes:
    """Return an encoded BATCH up to its payload of `payload_bytes` bytes, which must follow on the wire."""
    header = _pack((Op.BATCH, *fields))
    return _prefix(BIN_32, len(header) + payload_bytes) + header


def array_head(count: int) -> bytes:
    """Return the five-byte `array 32` head that starts the payload of a batch."""
    return _prefix(ARRAY_32, count)


_call = cast("Callable[[Check, Any], bool]", operator.call)

# Takes half the time of calling the class; frames have hundreds of entries.
_new_tuple = cast("Callable[[Any, Any], Any]", getattr(tuple, "__new__"))  # noqa: B009 - its type is lost


def _entries(kind: Any, width: int) -> Callable[[Any], tuple[Any, ...]]:
    """Return a constructor of entries with `width` fields; it ignores later ones, and missing ones are 0."""
    new, zeros = partial(_new_tuple, kind), (0,) * width
    return lambda items: tuple([new(it) if len(it) == width else new((it + zeros)[:width]) for it in items])


_requests: Final = _entries(RequestEntry, 4)
_replies: Final = _entries(ReplyEntry, 5)
_graph_entries: Final = _entries(GraphEntry, 7)
_topics: Final = _entries(TopicStats, 14)
_links: Final = _entries(LinkStats, 17)
_brokers: Final = _entries(MeshBrokerStats, 9)


def _request(endpoint: int, entries: Any) -> Frame:
    return Request(endpoint, _requests(entries))


def _reply(endpoint: int, entries: Any) -> Frame:
    return Reply(endpoint, _replies(entries))


def _graph(watch: int, more: bool, added: Any, *keys: tuple[int, ...]) -> Frame:  # noqa: FBT001 - in order
    return Graph(watch, more, _graph_entries(added), *keys)


def _stats(query: int, more: bool, totals: Options, topics: Any, links: Any, *later: Any) -> Frame:  # noqa: FBT001
    return Stats(query, more, totals, _topics(topics), _links(links), _brokers(later[0]), later[1])


def _reference(*fields: Any) -> Frame:
    reference = Reference(*fields)
    check_ends("REFERENCE", reference.length, reference.ends, reference.size)
    return reference


_NESTED: Final[Mapping[int, Callable[..., Frame]]] = {
    Op.REQUEST: _request,
    Op.REPLY: _reply,
    Op.GRAPH: _graph,
    Op.STATS: _stats,
    Op.REFERENCE: _reference,
}
"""The frames with lists of entries, which become NamedTuples, or with a check of several fields."""

_LISTS: Final = frozenset({"u32s", "u64s", "requests", "replies", "graph", "topics", "links", "brokers"})


class _Plan(NamedTuple):
    """How to decode one kind of frame. Made once from `SPECS`, because decoding is the hot path."""

    name: str
    width: int
    checks: tuple[Check, ...]
    make: Callable[..., Frame]
    has_payload: bool
    max_array_len: int
    defaults: tuple[Any, ...]
    """The defaults of the last fields, for a header that ends before them."""


_PLANS: Final[Mapping[int, _Plan]] = {
    op: _Plan(
        Op(op).name,
        len(spec.kinds),
        tuple(KINDS[kind] for kind in spec.kinds),
        _NESTED.get(op) or cast("Callable[..., Frame]", spec.frame),
        spec.has_payload,
        limits.MAX_HEADER_MAP if _LISTS.isdisjoint(spec.kinds) else limits.MAX_HEADER_ARRAY,
        tuple(cast("Any", spec.frame)._field_defaults.values()),
    )
    for op, spec in SPECS.items()
}

_BATCHES: Final = frozenset({Op.BATCH, Op.REPLAY})

_BATCH_SHAPES: Final = frozenset(
    (int, int, int, int, ends, attributes) for ends in (bytes, type(None)) for attributes in (type(None),)
)
"""The field types of nearly every BATCH: such a header needs a check of ranges only."""

_WINDOWS: Final = (1024, limits.MAX_HEADER_BYTES)
"""Prefixes of a frame with a payload that are tried as its header. The unpacker copies its input, and the
payload must not be copied."""

_MAX_FED_BYTES: Final = limits.MAX_FRAME_BYTES
"""Larger headers, which came in fragments, are unpacked in place."""

_SMALL_BYTES: Final = 128
"""A frame up to this size is unpacked without a check first: whatever lengths it announces, that takes at
most 45 KiB of memory."""


class Decoder:
    """Decodes frames and reuses its unpackers between them. Not thread-safe."""

    __slots__ = ("_unpackers",)

    def __init__(self) -> None:
        self._unpackers: dict[int, Any] = {}  # the type stubs of msgpack.Unpacker lack `skip`

    def decode(self, raw: Buffer) -> Frame:
        """Return the frame in `raw`: one whole frame, prefix included.

        Raises:
            ProtocolError: The bytes are not a frame, or a field is missing, out of range or of another type.
        """
        if len(raw) < limits.PREFIX_BYTES or raw[0] != BIN_32:
            raise _malformed("a frame is a msgpack bin 32 with a header array inside")
        if int.from_bytes(raw[1 : limits.PREFIX_BYTES], "big") != len(raw) - limits.PREFIX_BYTES:
            raise _malformed("a frame's prefix does not match its size")
        return self.decode_content(raw)

    def decode_content(self, raw: Buffer) -> Frame:
        """Return the frame in `raw`, whose prefix has been checked."""
        if len(raw) < limits.PREFIX_BYTES + 2:
            raise _malformed("a frame has a header array inside")
        marker, op = raw[5], raw[6]
        plan = _PLANS.get(op)
        if plan is None or not _FIXARRAY < marker <= _MAX_MARKER:
            raise _malformed(f"no frame has opcode {op} with array marker {marker:#04x}")
        content = memoryview(raw)[limits.PREFIX_BYTES :]
        try:
            if not plan.has_payload:
                return plan.make(*_checked(plan, self._whole(content, plan.max_array_len)))
            header, size = self._head(content, plan.max_array_len)
        except (ValueError, msgpack.UnpackException) as error:
            self._unpackers.clear()
            raise _malformed(f"header: {error!s:.200} ({type(error).__name__})") from error
        except BaseException:  # a MemoryError, for example
            self._unpackers.clear()  # they may keep a part of this frame, and the next may be another peer's
            raise
        payload = content[size:]
        fields = _checked(plan, header)
        if op in _BATCHES:
            # The payload stays encoded; its head must agree with the header, by which brokers cut batches.
            length = fields[-3]
            if bytes(payload[:ARRAY_HEAD_BYTES]) != array_head(length):
                text = f"{plan.name}: the payload does not start with an array 32 of {length} messages"
                raise _malformed(text)
            check_ends(plan.name, length, fields[-2], len(payload) - ARRAY_HEAD_BYTES)
        if op == Op.BATCH:
            return Batch(*fields, payload, raw)  # type: ignore[call-arg]  # mypy counts *fields as one
        return plan.make(*fields, payload)

    def _whole(self, content: memoryview, max_array_len: int) -> tuple[Any, ...]:
        """Return a header that fills the whole frame."""
        if len(content) > _MAX_FED_BYTES:
            check_depth(content, MAX_DEPTH)
            sizes = _limits(max_array_len)
            return cast("tuple[Any, ...]", msgpack.unpackb(content, max_bin_len=len(content), **sizes))
        small = len(content) <= _SMALL_BYTES
        limit = _SMALL_BYTES if small else max_array_len
        unpacker = self._unpackers.get(limit) or self._new_unpacker(limit)
        before = unpacker.tell()
        unpacker.feed(content)
        # `skip` first: it allocates nothing, and fails unless every announced element is there. `unpack`
        # would allocate what a few bytes announce.
        header: Any = unpacker.unpack() if small else unpacker.skip()
        if unpacker.tell() - before != len(content):
            raise ValueError("bytes follow the header array")
        if not small:
            unpacker.feed(content)
            header = unpacker.unpack()
        return header  # type: ignore[no-any-return]

    def _head(self, content: memoryview, max_array_len: int) -> tuple[tuple[Any, ...], int]:
        """Return the header at the start of a frame with a payload, and its size."""
        unpacker = self._unpackers.get(max_array_len) or self._new_unpacker(max_array_len)
        before = unpacker.tell()
        fed = 0
        for window in _WINDOWS:
            piece = content[fed:window]
            unpacker.feed(piece)
            fed += len(piece)
            try:
                unpacker.skip()
            except msgpack.OutOfData:
                if fed == len(content):
                    raise
                continue
            size = unpacker.tell() - before
            # Out with the payload's first bytes, so that the unpacker is empty, and then the header again.
            unpacker.read_bytes(fed - size)
            unpacker.feed(content[:size])
            header: tuple[Any, ...] = unpacker.unpack()
            return header, size
        raise ValueError(f"longer than {limits.MAX_HEADER_BYTES} bytes")

    def _new_unpacker(self, max_array_len: int) -> Any:
        unpacker = self._unpackers[max_array_len] = msgpack.Unpacker(
            None, read_size=4096, max_buffer_size=2 * _MAX_FED_BYTES, **_limits(max_array_len)
        )
        return unpacker


def decode(raw: Buffer) -> Frame:
    """Return the frame in `raw`, as `Decoder.decode` does."""
    return Decoder().decode(raw)


def _limits(max_array_len: int) -> dict[str, Any]:
    """Return msgpack's limits for a header.

    Msgpack allocates an array as soon as it has read its announced length, at each of 1,024 levels. So the
    lengths are compared with the content before (`Decoder._whole`).
    """
    return {
        "use_list": False,
        "strict_map_key": True,
        "max_str_len": limits.MAX_HEADER_STRING_BYTES,
        "max_array_len": max_array_len,
        "max_map_len": limits.MAX_HEADER_MAP,
        "max_ext_len": 0,
    }


def _checked(plan: _Plan, header: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the checked fields of a header."""
    width = plan.width
    if len(header) <= width:
        header = _with_defaults(plan, header)
    fields = header[1 : 1 + width]
    # The shortest check for the most frequent frame; all others are checked field by field.
    if plan.make is Batch and tuple(map(type, fields)) in _BATCH_SHAPES and _in_range(fields):
        return fields
    if not all(map(_call, plan.checks, fields)):  # checked once more, to name the field
        valid = list(map(_call, plan.checks, fields))
        position = valid.index(False)
        kind = SPECS[Op[plan.name]].kinds[position]
        raise _malformed(f"{plan.name}: field {position + 1} is not a valid {kind}")
    return fields


def _with_defaults(plan: _Plan, header: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a header of an earlier version with the defaults of its missing fields."""
    missing = plan.width + 1 - len(header)
    if missing > len(plan.defaults):
        least = plan.width - len(plan.defaults)
        raise _malformed(f"{plan.name} needs {least} fields, got {len(header) - 1}")
    return header + plan.defaults[-missing:]


def _in_range(batch_fields: tuple[Any, ...]) -> bool:
    publisher, sequence, stamp, length, _, _ = batch_fields
    return bool(publisher >= 0 and sequence >= 0 and stamp >= 0 and 1 <= length <= limits.MAX_BATCH_COUNT)


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text[: limits.MAX_ERROR_TEXT])
