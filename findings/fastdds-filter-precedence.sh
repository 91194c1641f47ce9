#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rmw-fastrtps-cpp 9.3.3 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A subscription's content filter is an expression in the SQL subset of the DDS specification, with AND, OR and NOT.
#
# Guess: as in SQL, AND binds before OR, and NOT before both.
# Seen: AND and OR are taken from left to right, so `A OR B AND C` is `(A OR B) AND C`; but behind `A AND`, a NOT begins a
#       group with what follows it: `A AND NOT B OR C` is `A AND (NOT B OR C)`. With parentheses it is as written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=87 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.subscription_content_filter_options import ContentFilterOptions
from std_msgs.msg import Int32

SEEN = {
    "data = 1 OR data = 2 AND data = 3": [],  # in SQL 1
    "data > 3 OR data = 1 AND data = 5": [5],  # in SQL 4 and 5
    "data > 3 OR (data = 1 AND data = 5)": [4, 5],
    "data > 1 AND NOT data = 3 OR data = 1": [2, 4, 5],  # in SQL 1, too
    "(data > 1 AND NOT data = 3) OR data = 1": [1, 2, 4, 5],
}


def received(expression):
    """Return which of the numbers 1 to 5 pass a filter."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node, passed, everything = Node("n", context=context), [], []
    options = ContentFilterOptions(filter_expression=expression, expression_parameters=[])
    node.create_subscription(Int32, "t", lambda m: passed.append(m.data), 50, content_filter_options=options)
    node.create_subscription(Int32, "t", lambda m: everything.append(m.data), 50)
    publisher = node.create_publisher(Int32, "t", 50)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while publisher.get_subscription_count() < 2:
        executor.spin_once(0.1)
    for number in range(1, 6):
        publisher.publish(Int32(data=number))
    while len(everything) < 5:
        executor.spin_once(1)
    for _ in range(50):  # what is late for the first subscription
        executor.spin_once(0.01)
    executor.shutdown()
    context.shutdown()
    return passed


found = {expression: received(expression) for expression in SEEN}
for expression, numbers in found.items():
    print(expression, numbers)
sys.exit(found != SEEN)
PYTHON
