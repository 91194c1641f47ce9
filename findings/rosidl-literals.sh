#!/usr/bin/env bash
# ros-rosidl-adapter 4.9.5 (ROS 2 Kilted) and rosbags 0.11.9, Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# Both read .msg definitions. Guess: a constant has one value, whoever reads its line, and a '#' between quotes
# belongs to the string.
#
#     line                 rosidl_adapter (what ROS 2 generates)   rosbags
#     uint8 A=010          10                                      8
#     string B="a # b"     "a   (with the quote)                   a # b
#     string C=a # b       a                                       a # b
#
# Seen: rosidl_adapter cuts each line at '#' before it looks at quotes, and then keeps the lone opening quote as
# part of the value, without a warning. rosbags keeps ROS 1's rule that a string constant goes on to the end of the
# line, and reads a leading zero as octal. Enumerations in real packages that are aligned with zeros (08, 010) differ.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rosidl-adapter==4.9.5 rosbags==0.11.9
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

from rosbags.typesys import get_types_from_msg
from rosidl_adapter.parser import parse_message_string

TEXT = 'uint8 A=010\nstring B="a # b"\nstring C=a # b\n'

ros = {each.name: each.value for each in parse_message_string("pkg", "M", TEXT).constants}
(constants, _) = get_types_from_msg(TEXT, "pkg/msg/M")["pkg/msg/M"]
bags = {name: value for name, _, value in constants}
print("rosidl_adapter:", ros)
print("rosbags:       ", bags)
sys.exit(ros != {"A": 10, "B": '"a', "C": "a"} or bags != {"A": 8, "B": "a # b", "C": "a # b"})
PYTHON
