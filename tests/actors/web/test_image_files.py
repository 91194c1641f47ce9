"""What becomes of the images in messages, and of messages that have none."""

from __future__ import annotations

from typing import Any

import pytest

from actors.interfaces.sensor_msgs.msg import CompressedImage, Image
from actors.interfaces.std_msgs.msg import String
from actors.web import image_files
from actors.web.image_files import ImageError, image_file_of
from tests.actors.web.image_data import JPEG, PNG_BEGIN, png_of, read_png

GRAY, RGB = 0, 2


@pytest.mark.parametrize(
    ("encoding", "big_endian", "data", "depth", "color", "row"),
    [
        ("mono8", 0, "01 02", 8, GRAY, "01 02"),
        ("mono16", 0, "01 02 03 04", 16, GRAY, "02 01 04 03"),
        ("mono16", 1, "01 02 03 04", 16, GRAY, "01 02 03 04"),
        ("rgb8", 0, "01 02 03 04 05 06", 8, RGB, "01 02 03 04 05 06"),
        ("bgr8", 0, "01 02 03 04 05 06", 8, RGB, "03 02 01 06 05 04"),
        ("rgba8", 0, "01 02 03 00 04 05 06 00", 8, RGB, "01 02 03 04 05 06"),
        ("bgra8", 0, "01 02 03 00 04 05 06 00", 8, RGB, "03 02 01 06 05 04"),
    ],
)
@pytest.mark.parametrize("padding", [b"", b"\xee\xee\xee"])
@pytest.mark.parametrize("untyped", [False, True])
def test_pixels_become_a_png_file(
    *,
    encoding: str,
    big_endian: int,
    data: str,
    depth: int,
    color: int,
    row: str,
    padding: bytes,
    untyped: bool,
) -> None:
    """In the order and depth of the encoding; without what fills up rows; from a message or its fields."""
    line = bytes.fromhex(data) + padding
    fields: dict[str, Any] = {
        "encoding": encoding,
        "is_bigendian": big_endian,
        "width": 2,
        "height": 3,
        "step": len(line),
        "data": line * 3,
    }
    file = image_file_of(fields if untyped else Image(**fields))
    assert (file.content_type, file.encoding) == ("image/png", encoding)
    assert (file.width, file.height) == (2, 3)
    header, rows = read_png(file.body)
    assert header == (2, 3, depth, color, 0, 0, 0)
    assert rows == (b"\0" + bytes.fromhex(row)) * 3


@pytest.mark.parametrize("format_text", ["", "jpeg", "png", "bgr8; jpeg compressed bgr8", "svg", "text/html"])
@pytest.mark.parametrize(
    ("data", "kind", "size"),
    [
        (JPEG, "image/jpeg", (5, 3)),
        (JPEG[:2] + b"\xff\xff" + JPEG[2:], "image/jpeg", (5, 3)),
        (png_of(2, 1, GRAY, b"\0\1\2"), "image/png", (2, 1)),
    ],
)
def test_a_file_is_passed_on_by_its_first_bytes(
    format_text: str, data: bytes, kind: str, size: tuple[int, int]
) -> None:
    """As it is; the text of the format does not matter."""
    file = image_file_of(CompressedImage(format=format_text, data=data))
    assert (file.content_type, file.body) == (kind, data)
    assert (file.width, file.height) == size


def image(**values: Any) -> Image:
    """Return a message with 2 x 2 pixels in rgb8, but for these values."""
    return Image(**{"width": 2, "height": 2, "encoding": "rgb8", "step": 6, "data": bytes(12), **values})


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (image(width=0), "empty"),
        (image(height=0), "empty"),
        (image(width=2**32 - 1, height=2**32 - 1, step=2**32 - 1), "at most"),
        (image(width=2**20, height=2**20), "at most"),
        (image(step=0), "step"),
        (image(step=5), "step"),
        (image(step=2**32 - 1), "data has 12 bytes"),
        (image(data=b""), "data has 0 bytes"),
        (image(data=bytes(11)), "data has 11 bytes"),
        (image(data=bytes(13)), "data has 13 bytes"),
        (image(encoding="bayer_rggb8"), "bayer_rggb8"),
        (image(encoding="\r\nSet-Cookie: a=b" + "x" * 1000), "not shown"),
        (image(encoding=""), "not shown"),
        (CompressedImage(), "neither"),
        (CompressedImage(format="png", data=b"<svg xmlns='http://www.w3.org/2000/svg'/>"), "neither"),
        (CompressedImage(data=b"GIF89a" + bytes(20)), "neither"),
        (CompressedImage(data=PNG_BEGIN), "neither"),
        (CompressedImage(data=png_of(2**31, 2**31, GRAY, b"")), "at most"),
        (CompressedImage(data=png_of(0, 1, GRAY, b"")), "empty"),
        (CompressedImage(data=b"\xff\xd8\xff"), "does not say"),
        (CompressedImage(data=b"\xff\xd8\xff\xe0\x00\x02" + b"\xff" * 100_000), "does not say"),
        (CompressedImage(data=b"\xff\xd8" + b"\xff\xe0\x00\x00" * 100_000), "does not say"),
        (String(data="no image"), "type str"),
        ({}, "no field 'data'"),
        ({"data": None}, "type NoneType"),
        ({"data": b"", "encoding": 5}, "neither"),
        ({"data": b"", "encoding": "rgb8"}, "no field 'width'"),
        ({"data": b"", "encoding": "rgb8", "width": "2", "height": 2, "step": 6}, "type str"),
        ({"data": b"", "encoding": "rgb8", "width": -2, "height": -2, "step": 6}, "empty"),
        ({"data": b"", "encoding": "rgb8", "width": 2.0, "height": 2, "step": 6}, "type float"),
    ],
)
def test_what_is_no_image_has_a_reason(message: Any, text: str) -> None:
    """One short line, whatever the fields say."""
    with pytest.raises(ImageError, match=text) as raised:
        image_file_of(message)
    assert len(str(raised.value)) < 200
    assert "\n" not in str(raised.value)


def test_an_image_with_too_many_bytes_is_not_converted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its size is said."""
    monkeypatch.setattr(image_files, "MAX_BYTES", 11)
    with pytest.raises(ImageError, match="12 bytes"):
        image_file_of(image())
