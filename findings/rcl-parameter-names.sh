#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rcl-yaml-param-parser 10.1.3 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A parameter's name can be given in three places: declare_parameter, a parameter file, and `-p NAME:=VALUE`.
#
# Guess: a name that one of them accepts is accepted by all.
# Seen: declare_parameter and a file accept `1a`, `a-b` and `a.1`, and the parameter has the file's value;
#       `-p` refuses all three: it wants what a topic's name could be made of.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 ros-rcl-yaml-param-parser==10.1.3 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
cd "$folder"
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=85 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import pathlib
import sys

import rclpy
from rclpy.node import Node


def value_with(name, *args):
    """Return the value of a parameter that these arguments give, or the name of the error."""
    context = rclpy.Context()
    try:
        rclpy.init(args=["--ros-args", *args], context=context)
    except Exception as error:
        return type(error).__name__
    value = Node("n", context=context).declare_parameter(name, 0).value
    context.shutdown()
    return value


seen = {}
for name in ("a1", "1a", "a-b", "a.1"):
    pathlib.Path("params.yaml").write_text(f'/n:\n  ros__parameters: {{"{name}": 3}}\n')
    seen[name] = value_with(name, "--params-file", "params.yaml"), value_with(name, "-p", f"{name}:=3")
print(*seen.items(), sep="\n")
sys.exit(seen["a1"] != (3, 3) or any(found[0] != 3 or found[1] == 3 for name, found in seen.items() if name != "a1"))
PYTHON
