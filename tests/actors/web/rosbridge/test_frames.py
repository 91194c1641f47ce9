"""The frames that clients get."""

from __future__ import annotations

import base64
import json
import struct
import zlib

import pytest

from actors.web.rosbridge.frames import as_png, in_fragments, operation, published


def _pixels(file: bytes) -> bytes:
    """Return the pixels of a PNG file whose rows are not filtered."""
    width, height = struct.unpack(">II", file[16:24])
    size = struct.unpack(">I", file[33:37])[0]
    assert file[37:41] == b"IDAT"
    rows = zlib.decompress(file[41 : 41 + size])
    stride = 1 + 3 * width
    assert len(rows) == stride * height
    return b"".join(rows[at + 1 : at + stride] for at in range(0, len(rows), stride))


def test_operations_are_json() -> None:
    """With parts that are JSON already."""
    assert json.loads(published('/a"b', b'{"data":1}')) == {
        "op": "publish",
        "topic": '/a"b',
        "msg": {"data": 1},
    }
    assert json.loads(operation("status", None, level="error", msg="ä")) == {
        "op": "status", "level": "error", "msg": "ä"
    }  # fmt: skip
    assert json.loads(operation("x", 0, {"values": b"[1]", "args": b"2"}, result=True)) == {
        "op": "x", "id": 0, "result": True, "values": [1], "args": 2
    }  # fmt: skip


@pytest.mark.parametrize("size", [12, 100, 1001])
def test_a_png_file_holds_an_operation(size: int) -> None:
    """In its pixels, with line ends behind it."""
    frame = operation("x", None, data="y" * size)
    found = json.loads(as_png(frame))
    assert found["op"] == "png"
    pixels = _pixels(base64.b64decode(found["data"]))
    assert pixels.rstrip(b"\n") == frame


def test_fragments_have_their_ids_and_whole_totals() -> None:
    """Together they are the operation, whatever characters it has."""
    frame = operation("x", None, data="äöü" * 10)
    parts = [json.loads(each) for each in in_fragments(frame, 10, "1")]
    assert {(each["op"], each["id"], each["total"]) for each in parts} == {("fragment", "1", len(parts))}
    assert [each["num"] for each in parts] == [*range(len(parts))]
    assert "".join(each["data"] for each in parts).encode() == frame
