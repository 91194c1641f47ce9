"""Passes on what it hears on `addison`, to `heard`. Written for rclpy; run it with `callboard run --ros`."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class PublishingSubscriber(Node):
    def __init__(self):
        super().__init__("publishing_subscriber")
        self.publisher = self.create_publisher(String, "heard", 10)
        self.subscription = self.create_subscription(String, "addison", self.pass_on, 10)

    def pass_on(self, message):
        message.data = f"I heard {message.data}"
        self.publisher.publish(message)
        self.get_logger().info(message.data)


def main(args=None):
    try:
        with rclpy.init(args=args):
            rclpy.spin(PublishingSubscriber())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
