#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rcl-yaml-param-parser 10.1.3 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# In a parameter file, keys may be nested or joined with dots: `a: {b: {x: 1}}` and `a.b.x: 1` are the same parameter.
#
# Guess: so are mixtures: `a.b: {c.d: {x: 1}, y: 2}` has the parameters a.b.c.d.x and a.b.y.
# Seen: it has a.b.c.d.x and a.b.c.y: at the end of a mapping one part of the name is dropped, although its key had two.
#       Without a dot in the inner key, `a.b: {c: {x: 1}, y: 2}`, it is a.b.y.
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


def names_in(parameters):
    pathlib.Path("params.yaml").write_text(f"/n:\n  ros__parameters: {parameters}\n")
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--params-file", "params.yaml"], context=context)
    node = Node("n", context=context, automatically_declare_parameters_from_overrides=True)
    names = sorted(name for name in node.get_parameters_by_prefix("a"))
    context.shutdown()
    return names


seen = {text: names_in(text) for text in ("{a.b: {c: {x: 1}, y: 2}}", "{a.b: {c.d: {x: 1}, y: 2}}")}
print(*seen.items(), sep="\n")
sys.exit(list(seen.values()) != [["b.c.x", "b.y"], ["b.c.d.x", "b.c.y"]])
PYTHON
