#!/usr/bin/env bash
# rosbags 0.11.9 and mcap-ros2-support 0.6.0, Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# A schema as MCAP files hold it: a message of package `pkg` has the field `Header header`, and the package has a
# Header.msg of its own, which the schema contains. In ROS 2 a type without a package is of the message's own package.
#
# Guess: both libraries read the field as pkg/Header, whose definition stands in the same text.
# Seen: mcap-ros2-support does, and so does ROS 2's rosidl_adapter. rosbags makes it std_msgs/msg/Header without a
#       word, next to a pkg/msg/Header that nothing refers to: it reads other fields from the same bytes.
#       A real package with a Header.msg of its own is enough.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap-ros2-support==0.6.0
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import struct
import sys

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import get_types_from_msg

SCHEMA = f"Header header\n{'=' * 80}\nMSG: pkg/Header\nuint32 count\n"
MESSAGE = bytes([0, 1, 0, 0]) + struct.pack("<I", 7)  # CDR, little-endian: count is 7

schema = Schema(id=1, name="pkg/msg/M", encoding="ros2msg", data=SCHEMA.encode())
count = DecoderFactory().decoder_for("cdr", schema)(MESSAGE).header.count
types = get_types_from_msg(SCHEMA, "pkg/msg/M")
(_, fields) = types["pkg/msg/M"]
((name, (_, type_name)),) = fields
print(f"mcap-ros2-support: header.count is {count}")
print(f"rosbags: {name} is a {type_name}; the schema defines {sorted(types)}")
sys.exit(not (count == 7 and type_name == "std_msgs/msg/Header" and "pkg/msg/Header" in types))
PYTHON
