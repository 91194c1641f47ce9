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
from functools import partial
from operator import lt
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

Check: TypeAlias = Callable[[Any], bool]

BIN_32: Final = 0xC6
ARRAY_32: Final = 0xDD
ARRAY_HEAD_BYTES: Final = 5

_FIXARRAY: Final = 0x90
_MAX_MARKER: Final = 0x9F
_LITTLE_ENDIAN: Final = sys.byteorder == "little"

_pack = cast("Callable[[object], bytes]", msgpack.Packer(autoreset=True).pack)

_LISTS: Final = frozenset({"u32s", "u64s", "requests", "replies", "graph"})


def _unpack_limits(kinds: tuple[str, ...]) -> Mapping[str, Any]:
    """Return msgpack's limits for a header of these fields.

    It allocates an array as soon as it has read how long it claims to be, at each of 1,024 levels.
    """
    return {
        "use_list": False,
        "strict_map_key": True,
        "max_str_len": limits.MAX_HEADER_STRING_BYTES,
        "max_array_len": limits.MAX_HEADER_MAP if _LISTS.isdisjoint(kinds) else limits.MAX_HEADER_ARRAY,
        "max_map_len": limits.MAX_HEADER_MAP,
        "max_ext_len": 0,
    }


_UNPACK_LIMITS: Final[Mapping[int, Mapping[str, Any]]] = {
    op: _unpack_limits(spec.kinds) for op, spec in SPECS.items()
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
    ends = array("I", data)
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
    if int.from_bytes(raw[1 : limits.PREFIX_BYTES], "big") != len(raw) - limits.PREFIX_BYTES:
        raise _malformed("a frame's prefix does not say its size")
    marker, op = raw[5], raw[6]
    spec = SPECS.get(op)
    if spec is None or not _FIXARRAY < marker <= _MAX_MARKER:
        raise _malformed(f"no frame has opcode {op} with array marker {marker:#04x}")
    header, payload = _unpack_header(memoryview(raw)[limits.PREFIX_BYTES :], op, has_payload=spec.has_payload)
    if len(header) <= len(spec.kinds):
        raise _malformed(f"{Op(op).name} needs {len(spec.kinds)} fields, got {len(header) - 1}")
    fields = header[1 : 1 + len(spec.kinds)]
    for position, (kind, value) in enumerate(zip(spec.kinds, fields, strict=True), 1):
        if not KINDS[kind](value):
            raise _malformed(f"{Op(op).name}: field {position} is not a valid {kind}")
    frame: Frame
    if not spec.has_payload:
        make = _DECODERS.get(op)
        frame = spec.frame(*fields) if make is None else make(fields)
    elif op == Op.FRAGMENT:
        frame = spec.frame(*fields, payload)
    else:
        _check_run(op, fields[-3], fields[-2], payload)
        frame = spec.frame(*fields, payload, raw) if op == Op.RUN else spec.frame(*fields, payload)
    return frame


def _unpack_header(content: memoryview, op: int, *, has_payload: bool) -> tuple[tuple[Any, ...], memoryview]:
    try:
        if not has_payload:
            header = msgpack.unpackb(content, max_bin_len=len(content), **_UNPACK_LIMITS[op])
            return header, content[:0]
        # The unpacker copies what it is fed, so it does not get a large payload.
        start = content[: limits.MAX_HEADER_BYTES]
        unpacker = msgpack.Unpacker(
            None, max_buffer_size=len(start), max_bin_len=len(start), **_UNPACK_LIMITS[op]
        )
        unpacker.feed(start)
        header = unpacker.unpack()
        return header, content[unpacker.tell() :]
    except (ValueError, msgpack.UnpackException) as error:
        raise _malformed(f"header: {error!s:.200} ({type(error).__name__})") from error


def _check_run(op: int, count: int, ends: bytes | None, payload: memoryview) -> None:
    """A run can be cut later without another look: its ends rise and the last is the payload's end."""
    if bytes(payload[:ARRAY_HEAD_BYTES]) != array_head(count):
        raise _malformed(f"{Op(op).name}: the payload does not start with an array 32 of {count} messages")
    body_bytes = len(payload) - ARRAY_HEAD_BYTES
    if count == 1:
        if ends is not None or body_bytes == 0:
            raise _malformed(f"{Op(op).name}: a single message has a body and no ends")
        return
    if ends is None or len(ends) != 4 * count:
        raise _malformed(f"{Op(op).name}: {count} messages need {4 * count} bytes of ends")
    offsets = ends_from_bytes(ends).tolist()
    if offsets[0] == 0 or offsets[-1] != body_bytes or not all(map(lt, offsets, offsets[1:])):
        raise _malformed(f"{Op(op).name}: the ends do not rise to the payload's end")


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text[: limits.MAX_ERROR_TEXT])


def _is_uint(limit: int) -> Check:
    def check(value: Any) -> bool:
        return type(value) is int and 0 <= value <= limit

    return check


def _optional(check: Check) -> Check:
    return lambda value: value is None or check(value)


def _sequence_of(check: Check) -> Check:
    return lambda value: value.__class__ is tuple and all(map(check, value))


def _is_flat_map(value: Any) -> bool:
    return value.__class__ is dict and all(
        type(key) is str and type(item) in _SCALARS for key, item in value.items()
    )


def _is_definition(value: Any) -> bool:
    return type(value) is bytes and len(value) <= limits.MAX_DEFINITION_BYTES


_SCALARS: Final = frozenset({str, bytes, int, float, bool, type(None)})
_is_u32 = _is_uint(limits.MAX_U32)
_is_u64 = _is_uint(limits.MAX_U64)


def _is_request(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 4:
        return False
    call, remaining, attributes, body = value if len(value) == 4 else value[:4]
    return (
        type(body) is bytes
        and type(call) is int
        and call >= 0
        and (remaining is None or _is_u32(remaining))
        and (attributes is None or _is_flat_map(attributes))
    )


def _is_reply(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 5:
        return False
    call, status, more, attributes, body = value if len(value) == 5 else value[:5]
    return (
        type(body) is bytes
        and type(call) is int
        and call >= 0
        and _is_u32(status)
        and more is False
        and (attributes is None or _is_flat_map(attributes))
    )


def _is_graph_entry(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 7:
        return False
    key, kind, *texts, qos = value[:7]
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


# Half the time of calling the class: entries come by the hundred.
_new_tuple = cast("Callable[[Any, Any], Any]", getattr(tuple, "__new__"))  # noqa: B009 - its type is lost


def _nested(op: Op, entry: Callable[..., Any], width: int, where: int) -> Callable[[tuple[Any, ...]], Frame]:
    """Make a decoder for a frame whose field `where` holds entries of `width` fields each."""
    frame = SPECS[op].frame
    new: Callable[[Any], Any] = partial(_new_tuple, entry)

    def make(fields: tuple[Any, ...]) -> Frame:
        entries = tuple([new(item) if len(item) == width else new(item[:width]) for item in fields[where]])
        made: Frame = frame(*fields[:where], entries, *fields[where + 1 :])
        return made

    return make


_DECODERS: Mapping[int, Callable[[tuple[Any, ...]], Frame]] = {
    Op.REQUEST: _nested(Op.REQUEST, RequestEntry, 4, 1),
    Op.REPLY: _nested(Op.REPLY, ReplyEntry, 5, 1),
    Op.GRAPH: _nested(Op.GRAPH, GraphEntry, 7, 2),
}
