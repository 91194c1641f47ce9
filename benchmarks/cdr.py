"""How long messages take to CDR and back, next to rosbags' codec, and to msgpack.

    pip install rosbags==0.11.9
    python benchmarks/cdr.py

All codecs take turns with each message; the least CPU time of all rounds counts. Ends with 1 if callboard is
less than 1.5 times as fast as rosbags with a small message, or takes more than 1.5 times as long as copying
to write a large one. (To read one, it copies nothing.)
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from actors.interfaces import cdr
from actors.interfaces.codec import codec_for
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from actors.interfaces.geometry_msgs.msg import PoseStamped, TransformStamped
from actors.interfaces.message import Message, type_name
from actors.interfaces.sensor_msgs.msg import Image, Imu, JointState, PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.interfaces.types import Float64Array

if TYPE_CHECKING:
    from collections.abc import Callable

SMALL_RATIO = 1.5
LARGE_RATIO = 1.5
SIZE = 1 << 20
ROUND_SEC = 0.01
"""CPU time of a round, at least."""

HEADER = Header(frame_id="base_link")
MESSAGES: dict[str, Message] = {
    "PoseStamped": PoseStamped(header=HEADER),
    "JointState(30)": JointState(
        header=HEADER,
        name=[f"joint_{number}" for number in range(30)],
        position=Float64Array([0.5] * 30),
        velocity=Float64Array([0.25] * 30),
        effort=Float64Array([1.0] * 30),
    ),
    "Imu": Imu(header=HEADER),
    "TFMessage(20)": TFMessage(
        transforms=[TransformStamped(header=HEADER, child_frame_id=f"link_{number}") for number in range(20)]
    ),
    "DiagnosticArray(10 x 5)": DiagnosticArray(
        header=HEADER,
        status=[
            DiagnosticStatus(
                level=b"\1",
                name=f"motor {number}",
                message="fine",
                hardware_id="m",
                values=[KeyValue(key=f"key{value}", value=str(value)) for value in range(5)],
            )
            for number in range(10)
        ],
    ),
    "Image(1 MiB)": Image(
        header=HEADER, height=512, width=512, encoding="rgba8", step=2048, data=bytes(SIZE)
    ),
    "PointCloud2(1 MiB)": PointCloud2(
        header=HEADER,
        height=1,
        width=SIZE // 16,
        fields=[
            PointField(name=name, offset=4 * number, datatype=PointField.FLOAT32, count=1)
            for number, name in enumerate("xyzi")
        ],
        point_step=16,
        row_step=SIZE,
        data=bytes(SIZE),
    ),
}


class Row(NamedTuple):
    """Microseconds for one message, by what was done."""

    name: str
    is_large: bool
    took: dict[str, float]

    def times(self, what: str) -> float:
        """Return how many times as long rosbags takes."""
        return self.took[f"rosbags {what}"] / self.took[what]


def main() -> int:
    """Measure, print a table, and say by the exit code whether all are fast enough."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    block = bytearray(SIZE)
    copying = measured({"copy": lambda: bytes(block)}, rounds)["copy"]
    rows = [measure(name, message, rounds) for name, message in MESSAGES.items()]
    print(
        f"{'us for a message':<26}encode  rosbags            decode  rosbags        from msgpack   to msgpack"
    )
    for row in rows:
        took = row.took
        print(
            f"{row.name:<25} {took['encode']:7.2f} {took['rosbags encode']:8.2f} {row.times('encode'):6.1f} x"
            f" {took['decode']:8.2f} {took['rosbags decode']:8.2f} {row.times('decode'):5.1f} x"
            f" {took['from msgpack']:12.2f} {took['to msgpack']:12.2f}"
        )
    print(f"{'copying 1 MiB':<25} {copying:7.2f}")
    small = [row.times(what) for row in rows if not row.is_large for what in ("encode", "decode")]
    large = [row.took[what] / copying for row in rows if row.is_large for what in ("encode", "decode")]
    return int(min(small) < SMALL_RATIO or max(large) > LARGE_RATIO)


def measure(name: str, message: Message, rounds: int) -> Row:
    """Measure everything for one message."""
    rosbags: Any = import_module("rosbags.typesys")
    store, ros_name = rosbags.get_typestore(rosbags.Stores.ROS2_KILTED), type_name(type(message))
    codec: Any = cdr.codec_for(type(message))
    msgpack: Any = codec_for(type(message))
    data, payload = codec.encode(message), msgpack.encode(message)
    theirs = store.deserialize_cdr(data, ros_name)
    if bytes(store.serialize_cdr(theirs, ros_name)) != data or codec.decode(data) != message:
        raise SystemExit(f"{name}: the codecs do not agree")
    took = measured(
        {
            "encode": lambda: codec.encode(message),
            "rosbags encode": lambda: store.serialize_cdr(theirs, ros_name),
            "decode": lambda: codec.decode(data),
            "rosbags decode": lambda: store.deserialize_cdr(data, ros_name),
            "from msgpack": lambda: codec.encode(msgpack.decode(payload)),
            "to msgpack": lambda: msgpack.encode(codec.decode(data)),
        },
        rounds,
    )
    return Row(name, len(data) > SIZE, took)


def measured(actions: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the least CPU time of each action in microseconds; they take turns."""
    counts = {name: _count(action) for name, action in actions.items()}
    found = dict.fromkeys(actions, float("inf"))
    for _ in range(rounds):
        for name, action in actions.items():
            found[name] = min(found[name], _cpu(action, counts[name]) / counts[name])
    return {name: 1e6 * seconds for name, seconds in found.items()}


def _count(action: Callable[[], object]) -> int:
    """Return how often to repeat an action in a round."""
    count = 1
    while _cpu(action, count) < ROUND_SEC:
        count *= 2
    return count


def _cpu(action: Callable[[], object], count: int) -> float:
    began = time.process_time()
    for _ in range(count):
        action()
    return time.process_time() - began


if __name__ == "__main__":
    sys.exit(main())
