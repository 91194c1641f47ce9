"""Messages in CBOR."""

from __future__ import annotations

import math
import sys
from typing import Any

import cbor2
import pytest

from actors.interfaces.sensor_msgs.msg import Image, LaserScan
from actors.web.rosbridge.cbor import cbor_values, encode_cbor, require_cbor
from actors.web.rosbridge.operations import OperationError


def test_sequences_are_typed_arrays() -> None:
    """Little-endian, by RFC 8746; NaN stays NaN, and bytes are bytes."""
    scan = cbor2.loads(encode_cbor({"msg": cbor_values(LaserScan(ranges=[1.0, 2.0], range_max=math.nan))}))[
        "msg"
    ]
    assert (scan["ranges"].tag, scan["ranges"].value) == (85, b"\0\0\x80\x3f\0\0\0\x40")
    assert math.isnan(scan["range_max"])
    assert scan["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert cbor2.loads(encode_cbor(cbor_values(Image(data=b"\0\1"))))["data"] == b"\0\1"


def test_a_missing_library_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the name of the extra."""
    missing: Any = None
    monkeypatch.setitem(sys.modules, "cbor2", missing)
    with pytest.raises(OperationError, match=r"callboard\[web\]"):
        require_cbor()
