"""The bytes of messages are those of ROS 2, in both directions.

Compared by their values: rclpy fills gaps with whatever its memory holds, and may write surplus bytes.
"""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

import pytest

from actors.interfaces import cdr
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from tests.interfaces.cdr_vectors import MISREAD, READ, REFUSED, WRITTEN, class_of
from tests.interfaces.imported import TYPES
from tests.interfaces.random_messages import message_classes, random_message, values_of
from tests.real_ros.differences import agree
from tests.real_ros.test_types import ONLY_HERE, common

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

EXCHANGED = (
    *(
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/Imu",
        "sensor_msgs/msg/JointState",
        "sensor_msgs/msg/CameraInfo",
    ),
    *(
        "std_msgs/msg/ByteMultiArray",
        "action_msgs/msg/GoalStatusArray",
        "diagnostic_msgs/msg/DiagnosticArray",
    ),
)
MESSAGES = 5
"""Messages of each type."""


@pytest.mark.parametrize("package", sorted(TYPES.keys() - ONLY_HERE))
def test_messages_of_a_package_are_exchanged_with_ros(package: str, real: Side) -> None:
    """All types, requests, responses, events, and the parts of actions, with random values."""
    for name in common(package, real):
        for cls in message_classes(find_interface(name)):
            random = Random(type_name(cls))
            messages = [cls(), *(random_message(cls, random) for _ in range(MESSAGES))]
            sent = [cdr.encode(each).hex() for each in messages]
            answers = real.call("serialization.exchanged", type_name(cls), sent)
            for message, (read, written) in zip(messages, answers, strict=True):
                values = [read, values_of(cdr.decode(cls, bytes.fromhex(written)))]
                agree("cdr", type_name(cls), real=values, callboard=[values_of(message)] * 2)


def test_ros_reads_and_writes_the_bytes_of_the_vectors(real: Side) -> None:
    """What `tests/interfaces/cdr_vectors.py` says is what real ROS 2 does."""
    for vector in (*WRITTEN, *READ):
        (answer,) = real.call("serialization.read", vector.type_name, [vector.data])
        agree("cdr", f"{vector.type_name}: {vector.data}", real=answer, callboard=vector.values)
    for name, data in REFUSED:
        (answer,) = real.call("serialization.read", name, [data])
        assert answer == {"raises": "RMWError"}


@pytest.mark.parametrize(("name", "data"), MISREAD)
def test_what_only_ros_reads_is_refused(name: str, data: str, real: Side) -> None:
    """Listed as different: ROS 2 gives a message that nobody has sent, or that its type does not allow."""
    (answer,) = real.call("serialization.read", name, [data])
    with pytest.raises(InvalidMessageError):
        cdr.decode(class_of(name), bytes.fromhex(data))
    agree("cdr", f"{name}: {data[:40]}", real=answer, callboard="refused")


@pytest.mark.parametrize("name", [*EXCHANGED, *(name for name in TYPES["test_msgs"] if "/msg/" in name)])
def test_programs_exchange_bytes_with_ros(name: str, real: Side, face: Side) -> None:
    """What either side's `serialize_message` writes, the other side's `deserialize_message` reads."""
    cls = class_of(name)
    sent = [cdr.encode(random_message(cls, Random(number))).hex() for number in range(MESSAGES)]
    of_real = real.call("serialization.exchanged", name, sent)
    of_face = face.call("serialization.exchanged", name, [data for _, data in of_real])
    again = real.call("serialization.exchanged", name, [data for _, data in of_face])
    values = [value for value, _ in of_real]
    assert [value for value, _ in again] == values
    agree("serialization", name, real=values, callboard=[value for value, _ in of_face])
