"""The answers of callboard next to those of rosbridge_suite on real ROS 2, which are recorded."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.rosbridge.questions import STAMP, answers

if TYPE_CHECKING:
    from tests.actors.web.rosbridge.bridge import Bridge

RECORDED: Final[dict[str, Any]] = json.loads(
    Path(__file__).with_name("recorded.json").read_text(encoding="utf-8")
)

POINT: Final = {"x": 1.0, "y": 0.0, "z": 0.0}
BETTER: Final[dict[str, Any]] = {
    "an array of octets": {"layout": {"dim": [], "data_offset": 0}, "data": [7]},
    "no header": {"header": {"stamp": STAMP, "frame_id": ""}, "point": POINT},
    "null for a float": {"data": None},
}
"""What callboard answers where rosbridge_suite does not do as the protocol says: docs/how-to/rosbridge.md."""


async def test_answers_are_those_of_rosbridge_suite(bridge: Bridge) -> None:
    """Except where they should not be."""
    assert RECORDED["rosbridge_suite"] == "2.1.0"
    found = await answers(partial(bridge.client.ws_connect, "/"), DEADLINE_SEC)
    expected = RECORDED["answers"]
    assert {name: answer for name, answer in found.items() if answer != expected[name]} == BETTER
    assert found.keys() == expected.keys()
