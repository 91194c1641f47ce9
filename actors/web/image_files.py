"""Images in messages as bodies that a browser draws. Pure.

The data of a sensor_msgs/msg/CompressedImage is passed on if it begins like a JPEG or PNG file, whatever its
`format` says. The pixels of a sensor_msgs/msg/Image become a PNG file, which has no other way to be read
(https://www.w3.org/TR/png-3/). An alpha channel is left out: cameras fill it with anything.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.tools.field_paths import InvalidFieldError, value_at
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_BYTES: Final = 32 * 1024 * 1024
"""Largest image in a message: 4K with three channels fits, and is compressed in less than a second."""

MAX_PIXELS: Final = 32 * 1024 * 1024
"""A browser needs four bytes for each, however small the file is."""

MAX_SIDE: Final = 65_535
"""Pixels of a row, and rows: JPEG has no more, and each row of a PNG file is a piece of work."""

JPEG: Final = "image/jpeg"
PNG: Final = "image/png"

_JPEG_BEGIN: Final = b"\xff\xd8\xff"
_JPEG_SEGMENTS: Final = 1000
"""Segments before the one with the size; cameras and editors write about ten."""
_JPEG_SIZES: Final = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_PNG_BEGIN: Final = b"\x89PNG\r\n\x1a\n"
_GRAY: Final = 0
_RGB: Final = 2
_FASTEST: Final = 1


class ImageError(CallboardError):
    """A message has no image that can be shown; the text says why."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ImageFile:
    """An image as a browser draws it.

    Attributes:
        body: A JPEG or PNG file.
        content_type: Which.
        width, height: In pixels.
        encoding: Of the message: "jpeg", "png", or that of its pixels.
    """

    body: bytes
    content_type: str
    width: int
    height: int
    encoding: str


def image_file_of(message: Any) -> ImageFile:
    """Return the image in a message.

    Args:
        message: With the fields of sensor_msgs/msg/Image or CompressedImage; a dict if its type is unknown.

    Raises:
        ImageError: It has none that can be shown.
    """
    data = _field(message, "data", bytes, bytearray, memoryview)
    if len(data) > MAX_BYTES:
        raise ImageError(f"The image has {len(data)} bytes; at most {MAX_BYTES} are shown")
    try:
        encoding = _field(message, "encoding", str)
    except ImageError:
        return _from_file(bytes(data))
    return _from_pixels(message, memoryview(data), encoding)


def rgb_file(width: int, pixels: bytes) -> bytes:
    """Return a PNG file.

    Args:
        width: In pixels.
        pixels: Three bytes for each, row by row, without anything between the rows.
    """
    stride = 3 * width
    view = memoryview(pixels)
    rows = (view[at : at + stride] for at in range(0, len(pixels), stride))
    return _png(width, len(pixels) // stride, _ENCODINGS["rgb8"], rows)


def _field(message: Any, name: str, *kinds: type[Any]) -> Any:
    try:
        value = value_at(message, name)
    except InvalidFieldError:
        raise ImageError(f"The message has no field '{name}', so it is not an image") from None
    if type(value) not in kinds:
        raise ImageError(f"The field '{name}' has the type {type(value).__name__}")
    return value


def _from_file(data: bytes) -> ImageFile:
    if data.startswith(_JPEG_BEGIN):
        kind, encoding, size = JPEG, "jpeg", _jpeg_size(data)
    elif data.startswith(_PNG_BEGIN) and data[12:16] == b"IHDR" and len(data) >= 24:
        kind, encoding, size = PNG, "png", struct.unpack(">II", data[16:24])
    else:
        raise ImageError(f"The data is neither a JPEG nor a PNG file: it begins with {data[:8].hex(' ')!r}")
    width, height = size
    _require_size(width, height)
    return ImageFile(body=data, content_type=kind, width=width, height=height, encoding=encoding)


def _jpeg_size(data: bytes) -> tuple[int, int]:
    """Return width and height, which are in the first "start of frame" segment."""
    place = 2
    for _ in range(_JPEG_SEGMENTS):
        head = data[place : place + 9]
        if len(head) < 9 or head[0] != 0xFF:
            break
        if head[1] in _JPEG_SIZES:
            height, width = struct.unpack(">HH", head[5:9])
            return width, height
        # A byte 0xFF may be repeated before a marker.
        place += 1 if head[1] == 0xFF else 2 + int.from_bytes(head[2:4], "big")
    raise ImageError("The JPEG file does not say how large the image is")


def _require_size(width: int, height: int) -> None:
    if width < 1 or height < 1:
        raise ImageError(f"The image is empty: {width} x {height}")
    if max(width, height) > MAX_SIDE:
        raise ImageError(f"The image is {width} x {height}; sides of at most {MAX_SIDE} pixels are shown")
    if width * height > MAX_PIXELS:
        raise ImageError(f"The image is {width} x {height}; at most {MAX_PIXELS} pixels are shown")


class _Pixels(NamedTuple):
    """One encoding of pixels.

    Attributes:
        size: The bytes of a pixel.
        order: The bytes of a pixel that PNG has, in its order.
        depth: The bits of a channel.
        color: PNG's color type.
    """

    size: int
    order: tuple[int, ...]
    depth: int
    color: int


_ENCODINGS: Final = {
    "mono8": _Pixels(1, (0,), 8, _GRAY),
    "mono16": _Pixels(2, (1, 0), 16, _GRAY),  # (0, 1) in a message that is big-endian
    "rgb8": _Pixels(3, (0, 1, 2), 8, _RGB),
    "bgr8": _Pixels(3, (2, 1, 0), 8, _RGB),
    "rgba8": _Pixels(4, (0, 1, 2), 8, _RGB),
    "bgra8": _Pixels(4, (2, 1, 0), 8, _RGB),
}
"""By their names in ROS (sensor_msgs/image_encodings.hpp)."""


def _from_pixels(message: Any, data: memoryview, encoding: str) -> ImageFile:
    pixels = _ENCODINGS.get(encoding)
    if pixels is None:
        raise ImageError(f"Images in {encoding[:32]!r} are not shown; those in {', '.join(_ENCODINGS)} are")
    width, height, step = (_field(message, name, int) for name in ("width", "height", "step"))
    _require_size(width, height)
    row_bytes = width * pixels.size
    if step < row_bytes:
        raise ImageError(f"The step is {step} bytes, but a row of {width} pixels has {row_bytes}")
    if len(data) != step * height:
        raise ImageError(
            f"The data has {len(data)} bytes; {height} rows with a step of {step} have {step * height}"
        )
    if pixels.depth > 8 and _field(message, "is_bigendian", int, bool):
        pixels = pixels._replace(order=pixels.order[::-1])
    rows = (_ordered(data[at : at + row_bytes], pixels) for at in range(0, len(data), step))
    body = _png(width, height, pixels, rows)
    return ImageFile(body=body, content_type=PNG, width=width, height=height, encoding=encoding)


def _ordered(row: memoryview, pixels: _Pixels) -> memoryview | bytearray:
    size, order = pixels.size, pixels.order
    if order == tuple(range(size)):
        return row
    raw = row.tobytes()
    found = bytearray(len(raw) // size * len(order))
    for to, at in enumerate(order):
        found[to :: len(order)] = raw[at::size]
    return found


def _png(width: int, height: int, pixels: _Pixels, rows: Iterable[memoryview | bytearray]) -> bytes:
    packer = zlib.compressobj(_FASTEST)
    packed = bytearray()
    for row in rows:
        packed += packer.compress(b"\0")  # the row is not filtered
        packed += packer.compress(row)
    packed += packer.flush()
    header = struct.pack(">IIBBBBB", width, height, pixels.depth, pixels.color, 0, 0, 0)
    return b"".join((_PNG_BEGIN, _chunk(b"IHDR", header), _chunk(b"IDAT", packed), _chunk(b"IEND", b"")))


def _chunk(name: bytes, data: bytes | bytearray) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(name)))
