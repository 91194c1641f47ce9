"""JSON in pieces: msgspec keeps all other threads waiting until it has encoded a value. Pure."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

if TYPE_CHECKING:
    from collections.abc import Iterator

PIECE: Final = 256
"""Members of a map or list that are encoded together."""

DEPTH: Final = 3
"""Levels of maps and lists that are taken apart: documents have long lists in these."""


def encode_json(document: object) -> bytes:
    """Return a document as JSON. NaN and infinity, which JSON lacks, become null.

    Args:
        document: Maps, lists, tuples, texts and numbers.
    """
    return b"".join(_pieces(document, DEPTH))


def _pieces(value: object, depth: int) -> Iterator[bytes]:
    if not depth or not value or not isinstance(value, (dict, list, tuple)):
        yield msgspec.json.encode(value)
    elif isinstance(value, dict):
        yield from _members(cast("dict[str, Any]", value), depth)
    else:
        yield from _elements(cast("list[Any]", value), depth)


def _members(value: dict[str, Any], depth: int) -> Iterator[bytes]:
    between = b"{"
    if len(value) > PIECE:
        members = iter(value.items())
        while piece := dict(islice(members, PIECE)):
            yield between + msgspec.json.encode(piece)[1:-1]
            between = b","
    else:
        for key, each in value.items():
            yield between + msgspec.json.encode(key) + b":"
            yield from _pieces(each, depth - 1)
            between = b","
    yield b"}"


def _elements(value: list[Any], depth: int) -> Iterator[bytes]:
    between = b"["
    if len(value) > PIECE:
        for start in range(0, len(value), PIECE):
            yield between + msgspec.json.encode(value[start : start + PIECE])[1:-1]
            between = b","
    else:
        for each in value:
            yield between
            yield from _pieces(each, depth - 1)
            between = b","
    yield b"]"
