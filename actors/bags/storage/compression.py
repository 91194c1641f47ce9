"""zstd and lz4, with a limit for decompressed data: a few bytes may expand a millionfold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import lz4.frame
import zstandard

from actors.bags.errors import InvalidBagOptionError

if TYPE_CHECKING:
    from collections.abc import Callable

NAMES: Final = ("none", "zstd", "lz4")
"""Compressions of a bag's chunks, by their names on the command line."""
MAX_EXPANSION: Final = 200
"""Limit for the growth by decompression beyond `SPARE_BYTES`; recordings grow about 20 times at most."""
SPARE_BYTES: Final = 128 * 1024 * 1024
"""What the smallest file may become: an empty image or map is a thousandth of its size when compressed."""
_MAX_WINDOW: Final = 128 * 1024 * 1024
"""The window of zstd's highest levels. A frame may ask for up to 2 GiB, which is memory to allocate."""


class CompressionError(ValueError):
    """Data cannot be decompressed, or would exceed the limit."""


def most_expanded(size: int) -> int:
    """Return the limit for decompressed bytes.

    Args:
        size: The number of compressed bytes.
    """
    return size * MAX_EXPANSION + SPARE_BYTES


def compressor(name: str) -> tuple[str, Callable[[bytes], bytes] | None]:
    """Return MCAP's name for a compression, and the function that compresses; "" and None for no compression.

    Args:
        name: One of `NAMES`.

    Raises:
        InvalidBagOptionError: The name is unknown.
    """
    if name == "none":
        return "", None
    if name == "zstd":
        return name, zstandard.ZstdCompressor().compress
    if name == "lz4":
        return name, lz4.frame.compress
    raise InvalidBagOptionError(f"compression is one of {', '.join(NAMES)}, not {name!r}")


def decompress(name: str, data: bytes, most: int) -> bytes:
    """Return decompressed bytes.

    Args:
        name: "zstd" or "lz4"; "" if the data is not compressed.
        data: The compressed bytes.
        most: Limit for the decompressed bytes; no more memory is allocated.

    Raises:
        CompressionError: The data is damaged, exceeds the limit, or the compression is unknown.
    """
    if name == "":
        found = data
    elif name == "zstd":
        found = _zstd(data, most)
    elif name == "lz4":
        found = _lz4(data, most)
    else:
        raise CompressionError(f"the compression {name[:40]!r} is unknown; callboard reads zstd and lz4")
    if len(found) > most:
        raise CompressionError(f"it has more than {most:,} bytes")
    return found


def _zstd(data: bytes, most: int) -> bytes:
    try:
        reader = zstandard.ZstdDecompressor(max_window_size=_MAX_WINDOW).stream_reader(
            data, read_across_frames=True
        )
        return reader.read(most + 1)
    except zstandard.ZstdError as error:
        raise CompressionError(f"it cannot be decompressed: {error}") from None


def _lz4(data: bytes, most: int) -> bytes:
    try:
        return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most + 1)
    except (RuntimeError, EOFError, ValueError) as error:
        raise CompressionError(f"it cannot be decompressed: {error}") from None
