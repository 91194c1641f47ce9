"""How deep a msgpack object nests, found without decoding it.

The headers of reassembled frames are too large for a second copy, so they are measured in place before
msgpack, which allocates each announced array at up to 1,024 levels, gets them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proto.wire.frames import Buffer

MAX_DEPTH: Final = 4
"""The depth of the deepest header: its array, a list, an entry, and a map or an array in the entry."""

_SHAPES: Final[Mapping[int, tuple[int, int, int]]] = {
    **{marker: (0, marker & 15, 2) for marker in range(0x80, 0x90)},
    **{marker: (0, marker & 15, 1) for marker in range(0x90, 0xA0)},
    **{marker: (0, marker & 31, 0) for marker in range(0xA0, 0xC0)},
    **{marker: (1 << marker - 0xC4, 0, 0) for marker in range(0xC4, 0xC7)},
    **{marker: (0, 4 << marker - 0xCA, 0) for marker in range(0xCA, 0xCC)},
    **{marker: (0, 1 << marker - 0xCC, 0) for marker in range(0xCC, 0xD0)},
    **{marker: (0, 1 << marker - 0xD0, 0) for marker in range(0xD0, 0xD4)},
    **{marker: (1 << marker - 0xD9, 0, 0) for marker in range(0xD9, 0xDC)},
    **{marker: (2 << marker - 0xDC, 0, 1) for marker in range(0xDC, 0xDE)},
    **{marker: (2 << marker - 0xDE, 0, 2) for marker in range(0xDE, 0xE0)},
}
"""By marker: the bytes of its length, the length itself if it is in the marker, and the objects per element
of an array or map (0: the length counts bytes). Other markers are whole objects or extension types."""

_EXTENSIONS: Final = frozenset((*range(0xC7, 0xCA), *range(0xD4, 0xD9)))


def check_depth(content: Buffer, most: int) -> None:
    """Check that the msgpack object at the start of some bytes nests at most `most` levels.

    Raises:
        ValueError: It nests deeper, is cut off, or has an extension type.
    """
    position, end = 0, len(content)
    missing = [1]  # objects that each open array or map still lacks
    while missing:
        if not missing[-1]:
            missing.pop()
            continue
        missing[-1] -= 1
        if position >= end:
            raise ValueError("cut off")
        marker = content[position]
        if marker in _EXTENSIONS:
            raise ValueError("extension types are not allowed")
        width, length, objects = _SHAPES.get(marker, (0, 0, 0))
        position += 1 + width
        if width:
            length = int.from_bytes(content[position - width : position], "big")
        if not objects:
            position += length
        elif len(missing) > most:
            raise ValueError(f"more than {most} levels of arrays and maps")
        else:
            missing.append(length * objects)
    if position > end:
        raise ValueError("cut off")
