"""zstd and lz4, within limits: what is compressed may expand a millionfold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import lz4.frame
import zstandard

if TYPE_CHECKING:
    from collections.abc import Callable

NAMES: Final = ("none", "zstd", "lz4")
"""What a bag's chunks may be compressed with, as on the command line."""


_MAX_WINDOW: Final = 128 * 1024 * 1024
"""The window of zstd's highest levels; a frame may ask for 2 GiB."""


class CompressionError(ValueError):
    """Bytes cannot be decompressed, or are larger than allowed."""


def compressor(name: str) -> tuple[str, Callable[[bytes], bytes] | None]:
    """Return how MCAP names a compression, and the function that compresses.

    Args:
        name: One of `NAMES`.

    Raises:
        ValueError: It is another one.
    """
    if name == "none":
        return "", None
    if name == "zstd":
        return name, zstandard.ZstdCompressor().compress
    if name == "lz4":
        return name, lz4.frame.compress
    raise ValueError(f"{name!r} is not one of {', '.join(NAMES)}")


def decompress(name: str, data: bytes, most: int) -> bytes:
    """Return decompressed bytes.

    Args:
        name: "zstd" or "lz4", or "" for bytes as they are.
        data: The compressed bytes.
        most: The most that they may be; no more memory is taken.

    Raises:
        CompressionError: They are more, or no such bytes, or the compression is unknown.
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
