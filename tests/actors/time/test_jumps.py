"""Thresholds and registration of jump callbacks."""

from __future__ import annotations

from typing import Any

import pytest

from actors.time.clock import Clock
from actors.time.jumps import ClockChange, JumpThreshold
from actors.time.types import Duration

SECOND = Duration(seconds=1)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"min_forward": Duration(), "min_backward": None}, "min_forward must be a positive"),
        ({"min_forward": -SECOND, "min_backward": None}, "min_forward must be a positive"),
        ({"min_forward": None, "min_backward": Duration()}, "min_backward must be a negative"),
        ({"min_forward": None, "min_backward": SECOND}, "min_backward must be a negative"),
        ({"min_forward": None, "min_backward": None, "on_clock_change": False}, "At least one"),
    ],
)
def test_a_threshold_without_sense_is_refused(fields: dict[str, Any], text: str) -> None:
    """Durations of the wrong sign, and a threshold that admits nothing, are ValueErrors."""
    with pytest.raises(ValueError, match=text):
        JumpThreshold(**fields)


def test_a_threshold_admits_its_jumps() -> None:
    """The limits themselves are admitted; a change of the source does not depend on them."""
    threshold = JumpThreshold(min_forward=SECOND, min_backward=-SECOND, on_clock_change=False)
    deltas = (10**9, 10**9 - 1, 0, 1 - 10**9, -(10**9))
    change = ClockChange.ROS_TIME_NO_CHANGE
    assert [threshold.admits(change, delta) for delta in deltas] == [True, False, False, False, True]
    assert not threshold.admits(ClockChange.ROS_TIME_ACTIVATED, 0)


def test_jump_callbacks_must_be_plain_functions() -> None:
    """None at all is a ValueError, something else a TypeError, as nobody would await an `async def`."""
    threshold = JumpThreshold(min_forward=SECOND, min_backward=None)
    with pytest.raises(ValueError, match="must be callable"):
        Clock().create_jump_callback(threshold)

    async def asynchronous(*_: object) -> None: ...

    wrong: Any
    for wrong in (5, asynchronous):
        with pytest.raises(TypeError, match="must be a plain function"):
            Clock().create_jump_callback(threshold, post_callback=wrong)
