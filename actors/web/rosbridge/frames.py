"""The operations that a client of rosbridge gets, as frames. Pure.

JSON is put together from parts, so that a message is encoded once for all clients of its topic.
"""

from __future__ import annotations

import binascii
import math
from typing import TYPE_CHECKING, Any

import msgspec

from actors.web.image_files import rgb_file
from actors.web.rosbridge.fragments import divided

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from actors.web.rosbridge.operations import Id


def published(topic: str, values: bytes) -> bytes:
    """Return a message.

    Args:
        topic: The topic as the client calls it: it finds its callbacks by this text.
        values: The message in JSON.
    """
    return b'{"op":"publish","topic":%s,"msg":%s}' % (_json(topic), values)


def operation(name: str, id_: Id, encoded: Mapping[str, bytes] | None = None, **fields: Any) -> bytes:
    """Return another operation.

    Args:
        name: Its name.
        id_: The id; None for none.
        encoded: Fields whose values are JSON already.
        **fields: Its other fields.
    """
    head = {"op": name} if id_ is None else {"op": name, "id": id_}
    text = _json(head | fields)
    if not encoded:
        return text
    return b"%s,%s}" % (
        text[:-1],
        b",".join(b"%s:%s" % (_json(key), value) for key, value in encoded.items()),
    )


def as_png(frame: bytes) -> bytes:
    """Return an operation as the pixels of a PNG file, row by row, with line ends to fill the last row.

    Args:
        frame: The operation in JSON.
    """
    width = max(1, math.isqrt(len(frame) // 3))
    height = -(-len(frame) // (3 * width))
    file = rgb_file(width, frame.ljust(3 * width * height, b"\n"))
    return operation("png", None, data=binascii.b2a_base64(file, newline=False).decode())


def in_fragments(frame: bytes, size: int, id_: str) -> Iterator[bytes]:
    """Return an operation that is larger than a client wants, in fragments.

    Args:
        frame: The operation in JSON.
        size: The characters of each fragment's data.
        id_: What its fragments, and those of no other operation, have as their id.
    """
    for number, total, part in divided(frame.decode(), size):
        yield operation("fragment", id_, data=part, num=number, total=total)


def _json(value: Any) -> bytes:
    return msgspec.json.encode(value)
