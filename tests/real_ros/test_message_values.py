"""Fields of messages take what they take in rclpy, but nothing is sent that the program has not given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

FIELDS = (
    *("Bool", "Byte", "Char", "Float32", "Float64", "Int8", "UInt8", "Int64", "UInt64", "String"),
    *("Float64MultiArray", "Float32MultiArray", "Int32MultiArray", "UInt8MultiArray", "ByteMultiArray"),
    *("Imu", "UUID"),
)
"""The keys of `programs/assigning.py`."""
NO_ACCIDENT = "the value itself, or an error"


def required(truth: dict[str, Any], answer: dict[str, Any]) -> tuple[object, object]:
    """Return what callboard has to do, and what it does.

    rclpy's answer counts if it has sent the value that it was given. Where it sends another one by accident,
    or raises, callboard sends the value itself or raises.
    """
    if truth.get("is_value"):
        return truth["sent"], answer.get("sent", "refused")
    return NO_ACCIDENT, NO_ACCIDENT if answer.get("is_value", True) else answer["sent"]


@pytest.mark.parametrize("name", FIELDS)
def test_values_of_a_field_are_sent_as_they_are(name: str, real: Side, face: Side) -> None:
    """Numbers and arrays of other types, of NumPy, too, are converted or refused, as is all else."""
    truths = real.call("assigning.sent", name, True)
    answers = face.call("assigning.sent", name, False)
    assert truths.keys() <= answers.keys()
    for shown, ways in answers.items():
        for way, answer in ways.items():
            real_answer, callboard = required(truths.get(shown, {}).get(way, {}), answer)
            agree("message value", f"{name}: {shown}, {way}", real=real_answer, callboard=callboard)
