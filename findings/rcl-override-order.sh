#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rcl-yaml-param-parser 10.1.3 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# A parameter file and, after it on the command line, `-p a:=2`. The later argument counts: that is how one tries
# another value without editing the file.
#
# Guess: `a` is 2 in both cases below.
# Seen: it is 2 if the file has only `/n: {a: 1}`. If a section for all nodes stands above it (`/**: {b: 1}`, which
#       does not even name `a`), it stays 1: `-p` without a node's name goes into the section `/**` that is there
#       already, and what comes later in the file wins over it. `-p n:a:=2`, with the node's name, is 2 in both.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 ros-rcl-yaml-param-parser==10.1.3 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
cd "$folder"
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=86 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import pathlib
import sys

import rclpy
from rclpy.node import Node

ONE = "/n:\n  ros__parameters:\n    a: 1\n"
ALL = "/**:\n  ros__parameters:\n    b: 1\n"


def value_of_a(text, override):
    pathlib.Path("params.yaml").write_text(text)
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--params-file", "params.yaml", "-p", override], context=context)
    value = Node("n", context=context, automatically_declare_parameters_from_overrides=True).get_parameter("a").value
    context.shutdown()
    return value


seen = {
    (name, override): value_of_a(text, override)
    for name, text in (("/n alone", ONE), ("/** above /n", ALL + ONE))
    for override in ("a:=2", "n:a:=2")
}
print(*seen.items(), sep="\n")
sys.exit(list(seen.values()) != [2, 2, 1, 2])
PYTHON
