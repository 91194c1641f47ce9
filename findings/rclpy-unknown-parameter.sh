#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rcl-interfaces as it requires (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A client asks a node for two parameters, of which the node has declared one. The comments of rcl_interfaces/srv/GetParameters
# say that the values are as many as the names, in their order, and that one which is not set has the type PARAMETER_NOT_SET.
#
# Guess: the answer has two values, one of them of the type PARAMETER_NOT_SET (0).
# Seen: it has none, also no types and no descriptors. Only a node that allows undeclared parameters answers as the comments say.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=88 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient


def answers(names, **options):
    """Return the types of the values, the types and the names of the descriptors that a node with `a` answers."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node("n", context=context, **options)
    node.declare_parameter("a", 1)
    client = AsyncParameterClient(node, "n")
    assert client.wait_for_services(30)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def result(future):
        executor.spin_until_future_complete(future, 30)
        return future.result()

    values = [value.type for value in result(client.get_parameters(names)).values]
    types = list(result(client.get_parameter_types(names)).types)
    descriptors = [each.name for each in result(client.describe_parameters(names)).descriptors]
    executor.shutdown()
    context.shutdown()
    return values, types, descriptors


found = (
    answers(["a"]),
    answers(["unknown", "a"]),
    answers(["unknown", "a"], allow_undeclared_parameters=True),
)
print(*found, sep="\n")
sys.exit(found != (([2], [2], ["a"]), ([], [], []), ([0, 2], [0, 2], ["", "a"])))
PYTHON
