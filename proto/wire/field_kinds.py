"""The kinds of header fields, each with a check of its values (docs/protocol.md §8.1).

The codec checks every field of every received header.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias, cast

import msgpack

from proto import limits

Check: TypeAlias = Callable[[Any], bool]

_pack: Final = cast("Callable[[object], bytes]", msgpack.Packer(autoreset=True).pack)


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


def _is_attributes(value: Any) -> bool:
    return _is_flat_map(value) and len(_pack(value)) <= limits.MAX_ATTRIBUTES_BYTES


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
        and (remaining is None or (type(remaining) is int and 0 <= remaining <= limits.MAX_U32))
        and (attributes is None or _is_attributes(attributes))
    )


def _is_reply(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 5:
        return False
    call, status, more, attributes, body = value if len(value) == 5 else value[:5]
    return (
        type(body) is bytes
        and type(call) is int
        and call >= 0
        and type(status) is int
        and 0 <= status <= limits.MAX_U32
        and more is False
        and (attributes is None or _is_attributes(attributes))
    )


def _is_graph_entry(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 7:
        return False
    key, kind, *texts, qos = value[:7]
    return _is_u64(key) and _is_u32(kind) and all(type(text) is str for text in texts) and _is_flat_map(qos)


def _is_topic(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 13:
        return False
    domain, name, *counts = value[:14]  # the last came later
    return _is_u32(domain) and type(name) is str and all(map(_is_u64, counts))


def _is_link(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 15:
        return False
    domain, session, agent, nodes, endpoints, suspended, *counts = value[:17]  # the last two came later
    return (
        _is_u32(domain)
        and type(agent) is str
        and nodes.__class__ is tuple
        and all(type(node) is str for node in nodes)
        and type(suspended) is bool
        and all(map(_is_u64, (session, endpoints, *counts)))
    )


def _is_broker(value: Any) -> bool:
    if value.__class__ is not tuple or len(value) < 9:
        return False
    number, name, version, direct, *counts = value[:9]
    return (
        type(name) is type(version) is str and type(direct) is bool and all(map(_is_u64, (number, *counts)))
    )


KINDS: Mapping[str, Check] = {
    "u32": _is_u32,
    "u32?": _optional(_is_u32),
    "u32s": _sequence_of(_is_u32),
    "u64": _is_u64,
    "u64?": _optional(_is_u64),
    "u64s": _sequence_of(_is_u64),
    "length": lambda value: type(value) is int and 1 <= value <= limits.MAX_BATCH_COUNT,
    "bool": lambda value: type(value) is bool,
    "str": str.__instancecheck__,  # decoded values are of no subclass; a lambda takes twice as long
    "str?": lambda value: value is None or type(value) is str,
    "bin?": lambda value: value is None or type(value) is bytes,
    "bin16": lambda value: type(value) is bytes and len(value) == limits.INSTANCE_BYTES,
    "definition?": _optional(_is_definition),
    "map": _is_flat_map,
    "attributes?": _optional(_is_attributes),
    "requests": _sequence_of(_is_request),
    "replies": _sequence_of(_is_reply),
    "graph": _sequence_of(_is_graph_entry),
    "topics": _sequence_of(_is_topic),
    "links": _sequence_of(_is_link),
    "brokers": _sequence_of(_is_broker),
}
"""The checks, by the names that frames.SPECS uses."""
