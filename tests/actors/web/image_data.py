"""Images for tests, and what is in the PNG files that the server makes."""

from __future__ import annotations

import struct
import zlib

PNG_BEGIN = b"\x89PNG\r\n\x1a\n"

JPEG = bytes.fromhex("ffd8ffe000104a46494600010100000100010000ffc0000b080003000501011100ffd9")
"""The beginning of a grayscale JPEG file of 5 x 3 pixels."""


def png_of(width: int, height: int, color: int, rows: bytes, depth: int = 8) -> bytes:
    """Return a PNG file; each row begins with its filter."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0)
    parts = (chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b""))
    return PNG_BEGIN + b"".join(parts)


def read_png(data: bytes) -> tuple[tuple[int, ...], bytes]:
    """Return the fields of a PNG file's header (width, height, depth, color, ...), and its rows.

    Each row begins with its filter. The check sums are compared.
    """
    assert data.startswith(PNG_BEGIN)
    place, header, packed = len(PNG_BEGIN), (), b""
    while place < len(data):
        length, name = struct.unpack(">I4s", data[place : place + 8])
        content = data[place + 8 : place + 8 + length]
        assert data[place + 8 + length :][:4] == struct.pack(">I", zlib.crc32(name + content))
        place += 12 + length
        if name == b"IHDR":
            header = struct.unpack(">IIBBBBB", content)
        elif name == b"IDAT":
            packed += content
    return header, zlib.decompress(packed)
