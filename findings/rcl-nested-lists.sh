#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rcl-yaml-param-parser 10.1.3 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# ROS 2 has no parameters that are lists of lists. Somebody writes one all the same, a matrix say, in a file or with -p.
#
# Guess: the node does not start, and the error names the parameter, as it does for a list of mixed types.
# Seen: it starts without a word, and the parameter is whatever came last: `[1, [2]]` is [2], `[[1, 2], 3]` is the
#       integer 3, `[1, [2, 3], 4]` is 4, and `[[1], [2.5]]` is [1].
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 ros-rcl-yaml-param-parser==10.1.3 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=87 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

import rclpy
from rclpy.node import Node

EXPECTED = {"[1, [2]]": [2], "[[1, 2], 3]": 3, "[1, [2, 3], 4]": 4, "[[1], [2.5]]": [1]}


def value_of(text):
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "-p", f"matrix:={text}"], context=context)
    node = Node("probe", context=context, automatically_declare_parameters_from_overrides=True)
    value = node.get_parameter("matrix").value
    context.shutdown()
    return list(value) if hasattr(value, "__iter__") else value


seen = {text: value_of(text) for text in EXPECTED}
print(*seen.items(), sep="\n")
sys.exit(seen != EXPECTED)
PYTHON
