"""Frames to bytes and back.

Every frame is a msgpack `bin 32`, so its size is known before it is buffered. Inside is a header (a msgpack
array of at most 15 fields whose first is the opcode, below 128) and then, for RUN, REPLAY and FRAGMENT only,
the payload. Whatever bytes come in, `decode` returns a frame whose fields have the types that `frames.py`
says, or raises ProtocolError, and never anything else.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias, cast

import msgpack

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.frames import (
    OPCODES,
    SPECS,
    Buffer,
    Frame,
    GraphEntry,
    Op,
    ReplyEntry,
    RequestEntry,
)

Check: TypeAlias = Callable[[object], bool]

BIN_32: Final = 0xC6
ARRAY_32: Final = 0xDD
ARRAY_HEAD_BYTES: Final = 5

_FIXARRAY: Final = 0x90
_MAX_MARKER: Final = 0x9F
_LITTLE_ENDIAN: Final = sys.byteorder == "little"

_pack = cast("Callable[[object], bytes]", msgpack.Packer(autoreset=True).pack)

_UNPACK_LIMITS: Final[Mapping[str, Any]] = {
    "use_list": False,
    "strict_map_key": True,
    "max_str_len": limits.MAX_HEADER_STRING_BYTES,
    "max_array_len": limits.MAX_HEADER_ARRAY,
    "max_map_len": limits.MAX_HEADER_MAP,
    "max_ext_len": 0,
}


def encode(frame: Frame) -> bytes:
    """Return the whole frame as it goes on the wire, prefix included.

    A frame whose content is over `limits.MAX_FRAME_BYTES` must travel as fragments (see fragments.py).
    """
    op = OPCODES[type(frame)]
    fields = len(SPECS[op].kinds)
    header = _pack((op, *frame[:fields]))
    if SPECS[op].has_payload:
        payload = cast("Buffer", frame[fields])
        size = (len(header) + len(payload)).to_bytes(4, "big")
        return b"".join((b"\xc6", size, header, payload))
    return b"\xc6" + len(header).to_bytes(4, "big") + header


def array_head(count: int) -> bytes:
    """Return the five-byte `array 32` head that starts a run's payload."""
    return b"\xdd" + count.to_bytes(4, "big")


def ends_to_bytes(ends: array[int]) -> bytes:
    """Return message end offsets (array typecode "I") as little-endian u32."""
    if not _LITTLE_ENDIAN:  # pragma: no cover
        ends = ends[:]
        ends.byteswap()
    return ends.tobytes()


def ends_from_bytes(data: bytes) -> array[int]:
    """Return little-endian u32 end offsets as an array."""
    ends = array("I")
    ends.frombytes(data)
    if not _LITTLE_ENDIAN:  # pragma: no cover
        ends.byteswap()
    return ends


def decode(raw: Buffer) -> Frame:
    """Return the frame in `raw`: one whole frame, prefix included.

    Raises:
        ProtocolError: The bytes are not a frame, or a field is missing, out of range or of another type.
    """
    if len(raw) < limits.PREFIX_BYTES + 2 or raw[0] != BIN_32:
        raise _malformed("a frame is a msgpack bin 32 with a header array inside")
    marker, op = raw[5], raw[6]
    spec = SPECS.get(op)
    if spec is None or not _FIXARRAY < marker <= _MAX_MARKER:
        raise _malformed(f"no frame has opcode {op} with array marker {marker:#04x}")
    header, payload = _unpack_header(memoryview(raw)[limits.PREFIX_BYTES :], has_payload=spec.has_payload)
    if len(header) <= len(spec.kinds):
        raise _malformed(f"{Op(op).name} needs {len(spec.kinds)} fields, got {len(header) - 1}")
    fields = header[1 : 1 + len(spec.kinds)]
    for position, (kind, value) in enumerate(zip(spec.kinds, fields, strict=True), 1):
        if not KINDS[kind](value):
            raise _malformed(f"{Op(op).name}: field {position} is not a valid {kind}")
    if not spec.has_payload:
        return _DECODERS[op](fields) if op in _DECODERS else cast("Frame", spec.frame(*fields))
    if op == Op.FRAGMENT:
        return cast("Frame", spec.frame(*fields, payload))
    _check_run(Op(op).name, fields[-3], fields[-2], payload)
    if op == Op.RUN:
        return cast("Frame", spec.frame(*fields, payload, raw))
    return cast("Frame", spec.frame(*fields, payload))


def _unpack_header(content: memoryview, *, has_payload: bool) -> tuple[tuple[Any, ...], memoryview]:
    try:
        if not has_payload:
            return msgpack.unpackb(content, max_bin_len=len(content), **_UNPACK_LIMITS), content[:0]
        unpacker = msgpack.Unpacker(
            None, max_buffer_size=len(content), max_bin_len=len(content), **_UNPACK_LIMITS
        )
        unpacker.feed(content)
        header = unpacker.unpack()
        return header, content[unpacker.tell() :]
    except (ValueError, msgpack.UnpackException) as error:
        raise _malformed(f"header: {error!s:.200} ({type(error).__name__})") from error


def _check_run(name: str, count: int, ends: bytes | None, payload: memoryview) -> None:
    """A run can be cut later without another look: its ends rise and the last is the payload's end."""
    if bytes(payload[:ARRAY_HEAD_BYTES]) != array_head(count):
        raise _malformed(f"{name}: the payload does not start with an array 32 of {count} messages")
    body_bytes = len(payload) - ARRAY_HEAD_BYTES
    if count == 1:
        if ends is not None or body_bytes == 0:
            raise _malformed(f"{name}: a single message has a body and no ends")
        return
    if ends is None or len(ends) != 4 * count:
        raise _malformed(f"{name}: {count} messages need {4 * count} bytes of ends")
    offsets = ends_from_bytes(ends).tolist()
    if offsets[0] == 0 or offsets[-1] != body_bytes or sorted(set(offsets)) != offsets:
        raise _malformed(f"{name}: the ends do not rise to the payload's end")


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text[: limits.MAX_ERROR_TEXT])


def _is_uint(limit: int) -> Check:
    def check(value: object) -> bool:
        return type(value) is int and 0 <= value <= limit

    return check


def _optional(check: Check) -> Check:
    return lambda value: value is None or check(value)


def _sequence_of(check: Check) -> Check:
    return lambda value: type(value) is tuple and all(map(check, cast("tuple[object, ...]", value)))


def _is_flat_map(value: object) -> bool:
    if type(value) is not dict:
        return False
    items = cast("dict[object, object]", value).items()
    return all(
        type(key) is str and (item is None or type(item) in {str, bytes, int, float, bool})
        for key, item in items
    )


def _is_definition(value: object) -> bool:
    return type(value) is bytes and len(value) <= limits.MAX_DEFINITION_BYTES


_is_u32 = _is_uint(limits.MAX_U32)
_is_u64 = _is_uint(limits.MAX_U64)


def _is_request(value: object) -> bool:
    if type(value) is not tuple or len(cast("tuple[object, ...]", value)) < 4:
        return False
    call, remaining, attributes, body = cast("tuple[object, ...]", value)[:4]
    return (
        type(body) is bytes
        and type(call) is int
        and call >= 0
        and (remaining is None or _is_u32(remaining))
        and (attributes is None or _is_flat_map(attributes))
    )


def _is_reply(value: object) -> bool:
    if type(value) is not tuple or len(cast("tuple[object, ...]", value)) < 5:
        return False
    call, status, more, attributes, body = cast("tuple[object, ...]", value)[:5]
    return (
        type(body) is bytes
        and type(call) is int
        and call >= 0
        and _is_u32(status)
        and more is False
        and (attributes is None or _is_flat_map(attributes))
    )


def _is_graph_entry(value: object) -> bool:
    if type(value) is not tuple or len(cast("tuple[object, ...]", value)) < 7:
        return False
    key, kind, *texts, qos = cast("tuple[object, ...]", value)[:7]
    return _is_u64(key) and _is_u32(kind) and all(type(text) is str for text in texts) and _is_flat_map(qos)


KINDS: Mapping[str, Check] = {
    "u32": _is_u32,
    "u32?": _optional(_is_u32),
    "u32s": _sequence_of(_is_u32),
    "u64": _is_u64,
    "u64?": _optional(_is_u64),
    "u64s": _sequence_of(_is_u64),
    "length": lambda value: type(value) is int and 1 <= value <= limits.MAX_RUN_COUNT,
    "bool": lambda value: type(value) is bool,
    "str": lambda value: type(value) is str,
    "str?": lambda value: value is None or type(value) is str,
    "bin?": lambda value: value is None or type(value) is bytes,
    "bin16": lambda value: type(value) is bytes and len(value) == limits.INSTANCE_BYTES,
    "definition?": _optional(_is_definition),
    "map": _is_flat_map,
    "map?": _optional(_is_flat_map),
    "requests": _sequence_of(_is_request),
    "replies": _sequence_of(_is_reply),
    "graph": _sequence_of(_is_graph_entry),
}
"""The kinds of header fields, and what a value of each must be."""


def _nested(op: Op, entry: Callable[..., Any], width: int, where: int) -> Callable[[tuple[Any, ...]], Frame]:
    """Make a decoder for a frame whose field `where` holds entries of `width` fields each."""
    frame = SPECS[op].frame

    def make(fields: tuple[Any, ...]) -> Frame:
        entries = tuple([entry(*item[:width]) for item in fields[where]])
        return cast("Frame", frame(*fields[:where], entries, *fields[where + 1 :]))

    return make


_DECODERS: Mapping[int, Callable[[tuple[Any, ...]], Frame]] = {
    Op.REQUEST: _nested(Op.REQUEST, RequestEntry, 4, 1),
    Op.REPLY: _nested(Op.REPLY, ReplyEntry, 5, 1),
    Op.GRAPH: _nested(Op.GRAPH, GraphEntry, 7, 2),
}
