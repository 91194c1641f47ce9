"""Nodes of ROS 2 beside an attack on a bridge: `python -m tests.ros2.programs.innocents` until it is killed.

`/echo` sends numbers of /innocent back on /innocent_back. `/victim`, with a thread of its own, answers calls
of /slow after a tenth of a second, and listens to /flood.
"""

import threading
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

SLOW_SEC = 0.1
DEEP = QoSProfile(depth=1000)


def answer(request, response):
    """Answer late."""
    time.sleep(SLOW_SEC)
    return response


def spin(node):
    """Run a node's callbacks."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin()


def main():
    """Run both nodes."""
    rclpy.init()
    echo, victim = rclpy.create_node("echo"), rclpy.create_node("victim")
    publisher = echo.create_publisher(Int64, "/innocent_back", DEEP)
    echo.create_subscription(Int64, "/innocent", publisher.publish, DEEP)
    victim.create_service(Trigger, "/slow", answer)
    victim.create_subscription(Image, "/flood", lambda message: None, 1)
    threading.Thread(target=spin, args=(victim,), daemon=True).start()
    spin(echo)


main()
