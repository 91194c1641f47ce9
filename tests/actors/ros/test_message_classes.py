"""Fields and names of message classes in processes that import ROS 2's names."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from array import array
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from actors.interfaces import types
from actors.interfaces.codec import codec_for
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_srvs.srv import SetBool
from actors.ros.message_classes import adopt, has_adopted

if TYPE_CHECKING:
    from pathlib import Path


def probe_class() -> Any:
    """Return a new class as the generator writes it."""

    class Probe(Message, type_name="lab_msgs/msg/Probe"):
        octets: types.UInt8Sequence = b"\x01"
        each: types.ByteSequence = b"\x02"
        numbers: types.Float64Sequence = types.Float64Array([1.5])
        small: types.Int8Sequence = types.Int8Array()
        text: str = "a"

    codec_for(Probe)  # while its annotations are found in this module
    Probe.__module__ = "lab_msgs.msg._probe"
    return Probe


def test_fields_are_converted_when_they_are_read() -> None:
    """The message is encoded as it is; what is read is kept, and can be changed."""
    probe = probe_class()
    adopt(probe)
    adopt(probe)
    assert has_adopted(probe)
    message: Any = codec_for(probe).decode(codec_for(probe).encode(probe()))
    assert message.octets == array("B", [1])
    assert type(message.numbers).__name__ == "array"  # not callboard's subclass
    message.numbers.append(2.0)
    message.octets.frombytes(b"ab")
    message.each.append(b"\x03")
    again = codec_for(probe).decode(codec_for(probe).encode(message))
    assert again.numbers.tolist() == [1.5, 2.0]
    assert again.octets.tobytes() == b"\x01ab"
    assert again.each == [b"\x02", b"\x03"]
    assert getattr(again, "_text") == "a"  # noqa: B009 - the name that ROS 2's classes have
    assert probe.__slots__ == ["_octets", "_each", "_numbers", "_small", "_text", "_check_fields"]
    assert copy.deepcopy(again) == again


def test_assigned_sequences_are_converted_or_refused() -> None:
    """Nothing is kept by reference, and no number changes."""
    probe = probe_class()
    adopt(probe)
    message: Any = probe()
    given = np.array([1, 2])
    value: Any
    for value in (given, [1, 2], (1, 2), range(1, 3), array("i", [1, 2]), given[::1]):
        message.numbers = value
        message.octets = value
        message.small = value
        assert (message.numbers.tolist(), message.octets.tobytes(), message.small.tolist()) == (
            *([1.0, 2.0], b"\1\2", [1, 2]),
        )
    for name, value in (
        ("octets", [300]),
        ("small", [1.5]),
        ("numbers", "1"),
        ("octets", {1: 2}),
        ("small", 5),
    ):
        with pytest.raises((TypeError, OverflowError)):
            setattr(message, name, value)
    message.octets = memoryview(b"cd")
    assert message.octets.tobytes() == b"cd"


def test_classes_written_by_hand_keep_their_values() -> None:
    """Only classes of definitions are changed, and none of this process by itself."""

    class Own(Message):
        octets: bytes = b"\x01"

    adopt(Own)
    assert Own().octets == b"\x01"
    assert Image().data == b""
    assert not has_adopted(Own)


CODE = """
import sys
sys.path.insert(0, {folder!r})
from actors.ros.finder import install
install()
import pickle
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool
from unique_identifier_msgs.msg import UUID
if "without" in sys.argv:
    sys.modules["numpy"] = None
print(type(Imu().orientation_covariance).__name__, type(UUID(uuid=bytes(16)).uuid).__name__)
print(SetBool.Request.__module__, SetBool.Request.__qualname__, SetBool.Event.__qualname__)
print(pickle.loads(pickle.dumps(SetBool.Request(data=True))))
try:
    UUID(uuid=range(300, 316))
except (ValueError, OverflowError):
    print("refused")
print(UUID([7] * 16).uuid[0])
for too_many in (lambda: UUID(bytes(16), uuid=bytes(16)), lambda: UUID(bytes(16), 1)):
    try:
        too_many()
    except TypeError as error:
        print(error)
print(pickle.dumps([SetBool.Request(data=True), UUID(uuid=[7] * 16)]).hex())
"""


@pytest.mark.parametrize("numpy", [True, False])
@pytest.mark.processes
def test_a_process_gets_them_with_and_without_numpy(numpy: bool, tmp_path: Path) -> None:
    """Fixed arrays are NumPy's if it is installed; the parts of services have ROS 2's names.

    Their messages can be unpickled here, where they have not.
    """
    command = [sys.executable, "-c", CODE.format(folder=str(tmp_path)), *([] if numpy else ["without"])]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    kind = "ndarray" if numpy else "array"
    *lines, pickled = done.stdout.splitlines()
    assert lines == [
        f"{kind} {kind}",
        "std_srvs.srv._set_bool SetBool_Request SetBool_Event",
        "std_srvs.srv.SetBool_Request(data=True)",
        "refused",
        "7",
        "Argument 'uuid' given by name and position",
        "Extra positional arguments provided",
    ]
    # This process has other names for the classes.
    request, identifier = pickle.loads(bytes.fromhex(pickled))
    assert request == SetBool.Request(data=True)
    assert bytes(identifier.uuid) == bytes([7] * 16)


def test_pickles_of_native_classes_stay() -> None:
    """Here nothing is renamed."""
    assert Image.__module__ == "actors.interfaces.sensor_msgs.msg._image"
    assert pickle.loads(pickle.dumps(Image(data=b"a"))).data == b"a"
