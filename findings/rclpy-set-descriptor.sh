#!/usr/bin/env bash
# ros-rclpy 9.1.2 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-27.
#
# A descriptor that has only a description is fine when a parameter is declared: the type comes from the value.
#
# Guess: `set_descriptor` takes the same descriptor for a parameter that is there.
# Seen: it raises InvalidParameterValueException, because the value has the type 2 and the descriptor's is 0, which
#       means "not set". The description is not changed. The type has to be repeated, or dynamic_typing be True.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=88 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import InvalidParameterValueException
from rclpy.node import Node

rclpy.init()
node = Node("probe")
node.declare_parameter("declared", 5, ParameterDescriptor(description="metres"))
node.declare_parameter("speed", 5)
try:
    node.set_descriptor("speed", ParameterDescriptor(description="metres"))
    refused = False
except InvalidParameterValueException as error:
    refused = True
    print(error)
described = [node.describe_parameter(name).description for name in ("declared", "speed")]
print(described)
rclpy.shutdown()
sys.exit(not refused or described != ["metres", ""])
PYTHON
