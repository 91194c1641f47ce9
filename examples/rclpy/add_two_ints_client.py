"""Adds two integers of the command line. Written for rclpy; run it with `callboard run --ros`."""

import sys

import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node
from rclpy.utilities import remove_ros_args


class AddTwoIntsClient(Node):
    def __init__(self):
        super().__init__("add_two_ints_client")
        self.client = self.create_client(AddTwoInts, "add_two_ints")
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("service not available, waiting again...")

    def add(self, a, b):
        request = AddTwoInts.Request()
        request.a = a
        request.b = b
        future = self.client.call_async(request)
        rclpy.spin_until_future_complete(self, future)
        return future.result().sum


def main(args=None):
    with rclpy.init(args=args):
        a, b = (int(each) for each in remove_ros_args(args)[1:])
        node = AddTwoIntsClient()
        node.get_logger().info(f"{a} + {b} = {node.add(a, b)}")


if __name__ == "__main__":
    main(sys.argv)
