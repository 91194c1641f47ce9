"""The codec: frames survive the trip, and hostile bytes end in a ProtocolError and nothing else."""

from __future__ import annotations

import contextlib
import itertools
from array import array
from typing import TYPE_CHECKING, Any, cast

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import field_kinds as kinds
from proto.wire import frames
from proto.wire.codec import Decoder, array_head, decode, encode
from proto.wire.codes import Op
from proto.wire.ends import ends_from_bytes, ends_to_bytes
from proto.wire.frames import SPECS, Frame, GraphEntry, ReplyEntry, RequestEntry
from proto.wire.stats import LinkStats, MeshBrokerStats, TopicStats
from tests.allocations import peak_bytes

if TYPE_CHECKING:
    from collections.abc import Callable


U32 = st.integers(0, limits.MAX_U32)
U64 = st.integers(0, limits.MAX_U64)
TEXT = st.text(st.characters(codec="utf-8"), max_size=20)
SMALL_BIN = st.binary(max_size=20)
FLAT_MAP = st.dictionaries(
    TEXT, TEXT | SMALL_BIN | st.integers(-(2**63), limits.MAX_U64) | st.booleans() | st.none(), max_size=4
)
KIND_STRATEGIES: dict[str, st.SearchStrategy[Any]] = {
    "u32": U32,
    "u32?": st.none() | U32,
    "u32s": st.lists(U32, max_size=5).map(tuple),
    "u64": U64,
    "u64?": st.none() | U64,
    "u64s": st.lists(U64, max_size=5).map(tuple),
    "bool": st.booleans(),
    "str": TEXT,
    "str?": st.none() | TEXT,
    "bin16": st.binary(min_size=16, max_size=16),
    "definition?": st.none() | SMALL_BIN,
    "map": FLAT_MAP,
    "attributes?": st.none() | FLAT_MAP,
    "requests": st.lists(
        st.builds(RequestEntry, U64, st.none() | U32, st.none() | FLAT_MAP, SMALL_BIN), max_size=4
    ).map(tuple),
    "replies": st.lists(
        st.builds(ReplyEntry, U64, U32, st.just(value=False), st.none() | FLAT_MAP, SMALL_BIN), max_size=4
    ).map(tuple),
    "graph": st.lists(st.builds(GraphEntry, U64, U32, TEXT, TEXT, TEXT, TEXT, FLAT_MAP), max_size=3).map(
        tuple
    ),
    "topics": st.lists(st.builds(TopicStats, U32, TEXT, *[U64] * 12), max_size=3).map(tuple),
    "links": st.lists(
        st.builds(LinkStats, U32, U64, TEXT, st.lists(TEXT).map(tuple), U64, st.booleans(), *[U64] * 11),
        max_size=3,
    ).map(tuple),
    "brokers": st.lists(
        st.builds(MeshBrokerStats, U64, TEXT, TEXT, st.booleans(), *[U64] * 5), max_size=3
    ).map(tuple),
}
GOOD: dict[str, object] = {
    "u32": 7,
    "u32?": None,
    "u32s": (1, 2),
    "u64": 2**40,
    "u64?": 3,
    "u64s": (2**40,),
    "length": 1,
    "bool": True,
    "str": "/x",
    "str?": None,
    "bin?": None,
    "bin16": bytes(16),
    "definition?": b"{}",
    "map": {"agent": "test"},
    "attributes?": None,
    "requests": ((1, 1000, None, b"a"), (2, None, {"k": 1}, b"")),
    "replies": ((1, 0, False, None, b"a"),),
    "graph": ((1, 0, "/n", "", "", "", {}),),
    "topics": ((0, "/t", *range(11)),),
    "links": ((0, 1, "test", ("/n",), 2, False, *range(9)),),
    "brokers": ((1, "robot", "0.1.0", True, *range(5)),),
}
ANYTHING: tuple[object, ...] = (
    ((0, "/t", *range(9)),), ((0, "/t", *range(9), -1),), ((0, 1, "test", (1,), 2, False, *range(9)),),
    ((0, 1, "test", ("/n",), 2, False, *range(9), -1),),
    ((0, 1, "test", ("/n",), 2, 0, *range(9)),), ((1, "robot", "0.1.0", 1, *range(5)),),
    None, True, -1, 2**32, 2**64 - 1, 0.5, float("nan"), "", "x", b"", b"x", bytes(16), (), (None,), {},
    {"k": {}}, {b"k": 1}, {"k": (1,)}, msgpack.ExtType(5, b""),
    ((1, None, None, "text"),), ((1, 0, True, None, b""),),
)  # fmt: skip
OPS = sorted(SPECS)


@st.composite
def batch_frames(draw: st.DrawFn) -> Frame:
    """Make a BATCH, REPLAY or REFERENCE whose table and messages fit."""
    messages = draw(st.lists(st.binary(min_size=1, max_size=12), min_size=1, max_size=8))
    ends = array("I")
    for message in messages:
        ends.append((ends[-1] if ends else 0) + len(message))
    payload = array_head(len(messages)) + b"".join(messages)
    table = ends_to_bytes(ends) if len(messages) > 1 else None
    attributes = draw(st.none() | FLAT_MAP)
    head = draw(U64), draw(U64), draw(U64), len(messages), table, attributes
    kind = draw(st.sampled_from([frames.Batch, frames.Replay, frames.Reference]))
    if kind is frames.Reference:
        size = ends[-1] if table else draw(U64)
        return frames.Reference(*head, draw(U32), draw(U64), draw(U64), size or 1, draw(U64))
    return (
        frames.Batch(*head, payload, b"")
        if kind is frames.Batch
        else frames.Replay(draw(U32), *head, payload)
    )


def plain_frames(op: int) -> st.SearchStrategy[Frame]:
    """Make any frame of one opcode."""
    spec = SPECS[op]
    fields = [KIND_STRATEGIES[kind] for kind in spec.kinds]
    if spec.has_payload:
        fields.append(SMALL_BIN)
    return cast("st.SearchStrategy[Frame]", st.builds(spec.frame, *fields))


BATCHES = {Op.BATCH, Op.REPLAY, Op.REFERENCE}
FRAMES = st.one_of(batch_frames(), *[plain_frames(op) for op in OPS if op not in BATCHES])


def framed(content: bytes) -> bytes:
    """Put the prefix before a frame's content."""
    return b"\xc6" + len(content).to_bytes(4, "big") + content


def header_of(op: int, fields: list[object], payload: bytes = b"") -> bytes:
    """Encode a header, however wrong its fields are."""
    return framed(msgpack.packb((op, *fields)) + payload)


def good_fields(op: int) -> tuple[list[object], bytes]:
    """Return fields and payload that make a valid frame of this opcode."""
    spec = SPECS[op]
    payload = array_head(1) + b"\x01" if op in {Op.BATCH, Op.REPLAY} else b"x" if spec.has_payload else b""
    return [GOOD[kind] for kind in spec.kinds], payload


def comparable(frame: Frame) -> tuple[object, ...]:
    """Return a frame's fields with views as bytes, and without `raw`."""
    fields = frame[:-1] if isinstance(frame, frames.Batch) else frame
    return type(frame), *[bytes(field) if isinstance(field, memoryview) else field for field in fields]


def refused(raw: bytes) -> ProtocolError:
    """Decode bytes that are not a frame."""
    with pytest.raises(ProtocolError) as caught:
        decode(raw)
    return caught.value


@given(FRAMES)
def test_every_frame_survives_the_trip(frame: Frame) -> None:
    """§3.2: what is encoded is decoded to an equal frame of the same class, and encodes to the same bytes."""
    raw = encode(frame)
    back = decode(raw)
    assert comparable(back) == comparable(frame)
    assert encode(back) == raw


def test_a_stock_msgpack_library_reads_the_stream() -> None:
    """§3.1: a frame is one msgpack bin, and its content starts with one msgpack array."""
    raw = encode(frames.Error(ErrorCode.LIMIT, "too many"))
    assert msgpack.unpackb(msgpack.unpackb(raw)) == [Op.ERROR, ErrorCode.LIMIT, "too many"]


def test_a_batch_keeps_its_bytes_and_copies_no_payload() -> None:
    """§6: `raw` is the very object that came in, and the payload is a view into it."""
    raw = encode(frames.Batch(1, 2, 3, 1, None, None, array_head(1) + bytes(1000), b""))
    batch = decode(raw)
    assert isinstance(batch, frames.Batch)
    assert batch.raw is raw
    assert isinstance(batch.payload, memoryview)
    assert batch.payload.obj is raw


def test_decoding_a_large_batch_allocates_little() -> None:
    """A 16 MiB payload is not copied into the unpacker to read a header of 30 bytes."""
    raw = encode(frames.Batch(1, 2, 3, 1, None, None, array_head(1) + bytes(16 << 20), b""))
    assert peak_bytes(lambda: decode(raw)) < 256 * 1024


@given(st.binary(max_size=80))
def test_random_bytes_end_in_a_protocol_error(data: bytes) -> None:
    """Arbitrary bytes, bare or under a right prefix, never raise anything but ProtocolError."""
    for raw in (data, framed(data), framed(b"\x93\x1e" + data), framed(b"\x93\x28" + data)):
        with contextlib.suppress(ProtocolError):
            decode(raw)


@given(st.data())
def test_damaged_frames_end_in_a_protocol_error(data: st.DataObject) -> None:
    """A valid frame with some bytes changed decodes to a frame or raises ProtocolError, and nothing else."""
    raw = bytearray(encode(data.draw(FRAMES)))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(5, len(raw) - 1))] = data.draw(st.integers(0, 255))
    try:
        frame = decode(bytes(raw))
    except ProtocolError:
        return
    encode(frame)


@pytest.mark.parametrize("op", OPS, ids=lambda op: Op(op).name)
def test_each_field_missing_extra_or_of_another_type(op: int) -> None:
    """Hostile case 16: a missing or wrong field is MALFORMED and names its place; extra ones are ignored."""
    fields, payload = good_fields(op)
    plain = comparable(decode(header_of(op, fields, payload)))
    for extra in ANYTHING:
        if len(fields) + 1 < 15:
            assert comparable(decode(header_of(op, [*fields, extra], payload))) == plain
    defaults = tuple(cast("Any", SPECS[op].frame)._field_defaults.values())
    for missing in range(1, len(fields) + 1):
        raw = header_of(op, fields[:-missing], payload)
        if missing <= len(defaults):
            assert decode(raw)[len(fields) - missing :] == defaults[-missing:]
        else:
            refused(raw)
    for place, kind in enumerate(SPECS[op].kinds):
        for value in ANYTHING:
            raw = header_of(op, [*fields[:place], value, *fields[place + 1 :]], payload)
            if kinds.KINDS[kind](value):
                continue
            error = refused(raw)
            assert error.code is ErrorCode.MALFORMED
            assert f"{Op(op).name}: field {place + 1}" in str(error) or "header" in str(error)


@pytest.mark.parametrize("op", OPS, ids=lambda op: Op(op).name)
def test_truncated_headers_and_trailing_bytes(op: int) -> None:
    """Hostile case 14: every truncation is MALFORMED, and so are bytes after a frame without payload."""
    fields, payload = good_fields(op)
    content = header_of(op, fields)[5:]
    for end in range(len(content)):
        refused(framed(content[:end]))
    if not SPECS[op].has_payload:
        refused(framed(content + b"\xc0"))
    raw = header_of(op, fields, payload)
    refused(raw + b"\xc0")
    refused(raw[:-1])


def test_extra_fields_in_entries_are_ignored() -> None:
    """§8: entries of REQUEST, REPLY, GRAPH and STATS may grow at their end, too."""
    raw = header_of(Op.REQUEST, [5, ((1, None, None, b"body", "later", 9),)])
    assert decode(raw) == frames.Request(5, (RequestEntry(1, None, None, b"body"),))
    raw = header_of(Op.REPLY, [5, ((1, 0, False, None, b"body", "later"),)])
    assert decode(raw) == frames.Reply(5, (ReplyEntry(1, 0, False, None, b"body"),))
    raw = header_of(Op.GRAPH, [5, False, ((1, 0, "/n", "", "", "", {}, None),), (), ()])
    assert decode(raw) == frames.Graph(5, False, (GraphEntry(1, 0, "/n", "", "", "", {}),), (), ())
    topic, link = (0, "/t", *range(12)), (0, 1, "test", ("/n",), 2, False, *range(11))
    raw = header_of(Op.STATS, [5, False, {}, ((*topic, "later"),), ((*link, "later"),)])
    assert decode(raw) == frames.Stats(5, False, {}, (TopicStats(*topic),), (LinkStats(*link),))


@pytest.mark.parametrize(
    ("op", "fields"),
    [
        (Op.REQUEST, [5, ((1, None, None),)]),
        (Op.REPLY, [5, ((1, 0, False, None),)]),
        (Op.GRAPH, [5, False, ((1, 0, "/n", "", "", ""),), (), ()]),
        (Op.GRAPH, [5, False, ((1, 0, {}),), (), ()]),
        (Op.STATS, [5, False, {}, ((0, "/t", *range(10)),), ()]),
        (Op.STATS, [5, False, {}, (), ((0, 1, "test", ("/n",), 2, False, *range(8)),)]),
    ],
)
def test_entries_with_too_few_fields_are_refused(op: Op, fields: list[Any]) -> None:
    """One field less than the first version had."""
    refused(header_of(op, fields))


def test_later_counts_of_topics_are_checked_and_may_be_missing() -> None:
    """§5.6.3: an earlier broker does not send the count of references; what is sent is a count."""
    topic = (0, "/t", *range(1, 12))
    earlier = header_of(Op.STATS, [5, False, {}, (topic,), ()])
    assert decode(earlier) == frames.Stats(5, False, {}, (TopicStats(*topic),), ())
    refused(header_of(Op.STATS, [5, False, {}, ((*topic, "many"),), ()]))


HOSTILE: dict[str, bytes] = {
    "empty": b"",
    "only a prefix": framed(b""),
    "one byte": framed(b"\x90"),
    "HTTP": b"GET / HTTP/1.1\r\nHost: x\r\n\r\n",
    "no opcode": framed(b"\x90\x90"),
    "unknown opcode": framed(b"\x92\x63\x01"),
    "opcode of two bytes": framed(b"\x92\xcc\x01\x01"),
    "map for a header": framed(b"\x81\x01\x02"),
    "array that claims 2**32 items": framed(b"\x93\x01\xdd\xff\xff\xff\xff"),
    "map that claims 2**32 items": framed(b"\x93\x01\x01\xdf\xff\xff\xff\xff"),
    "string that claims 4 GiB": framed(b"\x92\x04\xdb\xff\xff\xff\xff"),
    "bin that claims 4 GiB": framed(b"\x93\x36\xa1x\xc6\xff\xff\xff\xff"),
    "100,000 levels of arrays": framed(b"\x93\x01" + b"\x91" * 100_000 + b"\xc0"),
    "100,000 levels of maps": framed(b"\x93\x01\x01" + b"\x81\xa1x" * 100_000 + b"\xc0"),
    "levels of arrays that claim a lot": framed(b"\x93\x01" + b"\xdc\x20\x00" * 1300),
    "reserved msgpack byte": framed(b"\x92\x05\xc1"),
    "extension": framed(b"\x92\x05\xd4\x05\x00"),
    "impossible timestamp": framed(b"\x92\x05\xd7\xff" + b"\xff" * 8),
    "empty timestamp": framed(b"\x92\x05\xc7\x00\xff"),
    "invalid UTF-8": framed(b"\x92\x04\xa2\xff\xfe"),
    "lone surrogate": framed(b"\x92\x04\xa3\xed\xa0\x80"),
    "array for a key": framed(b"\x93\x01\x01\x81\x91\x01\x02"),
    "nil for a key": framed(b"\x93\x01\x01\x81\xc0\x02"),
    "number for a key": framed(b"\x93\x01\x01\x81\x01\x02"),
    "bin for a key": framed(b"\x93\x01\x01\x81\xc4\x01x\x02"),
    "long string": header_of(Op.GOODBYE, ["x" * (limits.MAX_HEADER_STRING_BYTES + 1)]),
    "many keys": header_of(Op.HELLO, [1, {str(i): i for i in range(limits.MAX_HEADER_MAP + 1)}]),
    "many ids": header_of(Op.CANCEL, [1, tuple(range(limits.MAX_HEADER_ARRAY + 1))]),
    "long definition": header_of(Op.DEFINITION, ["h", bytes(limits.MAX_DEFINITION_BYTES + 1)]),
    "negative id": header_of(Op.UNDECLARE, [-1]),
    "33-bit id": header_of(Op.UNDECLARE, [2**32]),
    "negative call": header_of(Op.REQUEST, [1, ((-1, None, None, b""),)]),
    "bool for an id": header_of(Op.UNDECLARE, [True]),
}  # fmt: skip


@pytest.mark.parametrize("raw", HOSTILE.values(), ids=HOSTILE.keys())
def test_hostile_bytes(raw: bytes) -> None:
    """Hostile cases 4, 6, 10 to 15, 17: each is MALFORMED."""
    assert refused(raw).code is ErrorCode.MALFORMED


def test_hostile_claims_cost_no_memory() -> None:
    """Hostile case 10: announced sizes make the decoder allocate less than 2 MiB."""

    def refuse_all() -> None:
        for raw in HOSTILE.values():
            refused(raw)

    assert peak_bytes(refuse_all) < 2 * 1024 * 1024


NESTED_CLAIMS: dict[str, bytes] = {
    "arrays": b"\xdc\x20\x00" * 1000,
    "arrays after values": b"\xdc\x20\x00\xc0" * 750,
    "arrays of 128": b"\xdc\x00\x80" * 1000,
    "small arrays": b"\x9f" * 1000,
    "maps": b"\xde\x00\x40\xa1x" * 600,
}


@pytest.mark.parametrize("claims", NESTED_CLAIMS.values(), ids=NESTED_CLAIMS.keys())
def test_nested_claims_are_compared_with_the_content_first(claims: bytes) -> None:
    """Case 50: nested claims make the decoder allocate little more than an unpacker (it was 64 MiB)."""
    decoder = Decoder()
    unpacker = peak_bytes(lambda: decode(encode(frames.Ping(0))))
    for op, size in itertools.product(OPS, (120, 3000)):
        raw = framed((bytes((0x93, op, 0x01)) + claims)[:size])

        def refuse(raw: bytes = raw) -> None:
            with pytest.raises(ProtocolError):
                decoder.decode_content(raw)

        assert peak_bytes(refuse) < unpacker + 48 * 1024, Op(op).name


def test_nested_claims_in_a_reassembled_frame_are_found_in_place() -> None:
    """Case 50: a frame beyond MAX_FRAME_BYTES is not copied to find out how deep it nests."""
    raw = framed(b"\x93\x28\x01" + b"\xdc\x20\x00" * 100_000)
    assert refused(raw).code is ErrorCode.MALFORMED
    assert peak_bytes(lambda: refused(raw)) < 32 * 1024


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
@pytest.mark.parametrize("op", [Op.BATCH, Op.PING])
def test_no_bytes_survive_an_exception(
    monkeypatch: pytest.MonkeyPatch, op: int, error: type[BaseException]
) -> None:
    """Case 51: a decoder that ran out of memory takes nothing of that frame for a part of the next one."""
    failing = True

    class Unpacker(msgpack.Unpacker):
        def unpack(self) -> object:
            if failing:
                raise error
            return super().unpack()

    monkeypatch.setattr(msgpack, "Unpacker", Unpacker)
    decoder = Decoder()
    fields, payload = good_fields(op)
    with pytest.raises(error):
        decoder.decode(header_of(op, fields, payload))
    failing = False
    fields[0] = 2**41
    assert decoder.decode(header_of(op, fields, payload))[0] == 2**41


def test_the_last_of_duplicate_keys_counts() -> None:
    """§3.3: duplicate keys are not an error; the last one counts."""
    frame = decode(framed(b"\x93\x01\x01\x82\xa1k\x01\xa1k\x02"))
    assert frame == frames.Hello(1, {"k": 2})


BATCH_PARTS: tuple[int, bytes | None, bytes] = (2, ends_to_bytes(array("I", [1, 3])), array_head(2) + b"abc")


@pytest.mark.parametrize(
    ("count", "ends", "payload"),
    [
        (3, BATCH_PARTS[1], BATCH_PARTS[2]),
        (2, None, BATCH_PARTS[2]),
        (2, b"", BATCH_PARTS[2]),
        (2, b"\x01\0\0\0", BATCH_PARTS[2]),
        (2, ends_to_bytes(array("I", [1, 2])), BATCH_PARTS[2]),
        (2, ends_to_bytes(array("I", [3, 1])), BATCH_PARTS[2]),
        (2, ends_to_bytes(array("I", [3, 3])), BATCH_PARTS[2]),
        (2, ends_to_bytes(array("I", [0, 3])), BATCH_PARTS[2]),
        (2, ends_to_bytes(array("I", [2**32 - 1, 3])), BATCH_PARTS[2]),
        (2, BATCH_PARTS[1], b"\x92abc"),
        (2, BATCH_PARTS[1], b""),
        (1, None, array_head(1)),
        (1, ends_to_bytes(array("I", [1])), array_head(1) + b"a"),
        (0, None, array_head(0)),
        (limits.MAX_BATCH_COUNT + 1, None, array_head(limits.MAX_BATCH_COUNT + 1)),
    ],
)
@pytest.mark.parametrize("op", [Op.BATCH, Op.REPLAY])
def test_batches_that_could_not_be_split(op: int, count: int, ends: bytes | None, payload: bytes) -> None:
    """§6: count, ends and payload that do not fit together are MALFORMED."""
    head: list[object] = [1] if op == Op.REPLAY else []
    refused(header_of(op, [*head, 1, 2, 3, count, ends, None], payload))
    count, ends, payload = BATCH_PARTS
    decode(header_of(op, [*head, 1, 2, 3, count, ends, None], payload))


@given(st.lists(U32, max_size=20))
def test_ends_survive_the_trip(offsets: list[int]) -> None:
    """End offsets travel as little-endian u32."""
    data = ends_to_bytes(array("I", offsets))
    assert data == b"".join(offset.to_bytes(4, "little") for offset in offsets)
    assert ends_from_bytes(data).tolist() == offsets


def test_a_header_beyond_its_limit_is_refused() -> None:
    """§3.3: the header of a frame with payload ends within MAX_HEADER_BYTES."""
    attributes = {str(i): b"x" * 1024 for i in range(64)}
    error = refused(header_of(Op.BATCH, [1, 2, 3, 1, None, attributes], array_head(1) + b"\x01"))
    assert error.code is ErrorCode.MALFORMED


def test_error_texts_stay_short() -> None:
    """An error text fits into an ERROR frame however long the offending input is."""
    texts: list[Callable[[], ProtocolError]] = [lambda raw=raw: refused(raw) for raw in HOSTILE.values()]  # type: ignore[misc]
    assert all(len(str(text())) <= limits.MAX_ERROR_TEXT for text in texts)
