#!/usr/bin/env bash
# ros-rclpy 9.1.2 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# The callback of a subscription takes two arguments, the message and the information about it, as rclpy allows. One
# message is published, and the node is spun by `SingleThreadedExecutor` and by `rclpy.experimental.EventsExecutor`.
#
# Guess: both call the callback with the message and a dict.
# Seen: the second raises "SystemError: null argument to internal routine" instead. With a callback of one argument it
# works.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=86 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from std_msgs.msg import String


def spun(executor_class, callback_of):
    """Return what a callback gets from an executor, or what that raises."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node, found = rclpy.create_node("n", context=context), []
    node.create_subscription(String, "topic", callback_of(found), 10)
    publisher = node.create_publisher(String, "topic", 10)
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    publisher.publish(String(data="text"))
    executor = executor_class(context=context)
    executor.add_node(node)
    end = time.monotonic() + 30
    try:
        while not found and time.monotonic() < end:
            executor.spin_once(timeout_sec=1.0)
    except SystemError as error:
        return repr(error)
    finally:
        context.shutdown()
    return found


def one(found):
    return lambda message: found.append(message.data)


def two(found):
    return lambda message, info: found.append((message.data, type(info).__name__))


print(seen := [spun(SingleThreadedExecutor, two), spun(EventsExecutor, one), spun(EventsExecutor, two)])
sys.exit(seen != [[("text", "dict")], ["text"], "SystemError('null argument to internal routine')"])
PYTHON
