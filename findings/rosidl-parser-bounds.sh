#!/usr/bin/env bash
# ros-rosidl-parser 4.9.5 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# Two fields of an .idl file that differ in one letter: a sequence of any length of strings of at most five
# characters, once `string`, once `wstring`.
#
#     sequence<string<5>> narrow;
#     sequence<wstring<5>> wide;
#
# Guess: the bound is the strings', and both sequences have any length.
# Seen: the sequence of wide strings gets a bound of its own, 5, which nothing in the file says: a BoundedSequence of
#       at most five elements. With a bound of its own, `sequence<wstring<5>, 3>`, it is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rosidl-parser==4.9.5
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

from rosidl_parser.definition import Message
from rosidl_parser.parser import parse_idl_string

TEXT = """
module pkg { module msg {
struct M {
  sequence<string<5>> narrow;
  sequence<wstring<5>> wide;
  sequence<wstring<5>, 3> both;
};
}; };
"""

(message,) = parse_idl_string(TEXT).get_elements_of_type(Message)
seen = {
    member.name: (
        type(member.type).__name__,
        getattr(member.type, "maximum_size", None),
        member.type.value_type.maximum_size,
    )
    for member in message.structure.members
}
print(*seen.items(), sep="\n")
sys.exit(
    seen
    != {
        "narrow": ("UnboundedSequence", None, 5),
        "wide": ("BoundedSequence", 5, 5),
        "both": ("BoundedSequence", 3, 5),
    }
)
PYTHON
