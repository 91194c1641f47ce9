"""Says "Hi Automatic Addison: N" twice a second. Written for rclpy; run it with `callboard run --ros`."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String


class MinimalPublisher(Node):
    def __init__(self):
        super().__init__("minimal_publisher")
        self.publisher = self.create_publisher(String, "addison", 10)
        self.timer = self.create_timer(0.5, self.publish)
        self.count = 0

    def publish(self):
        message = String()
        message.data = f"Hi Automatic Addison: {self.count}"
        self.publisher.publish(message)
        self.get_logger().info(f'Publishing: "{message.data}"')
        self.count += 1


def main(args=None):
    try:
        with rclpy.init(args=args):
            rclpy.spin(MinimalPublisher())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
