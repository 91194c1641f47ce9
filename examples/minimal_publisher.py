"""Publish a message on the topic `addison` twice a second.

Beside it run `callboard broker` and `python examples/minimal_subscriber.py`.
"""

import callboard
from actors.interfaces.std_msgs.msg import String


class MinimalPublisher(callboard.Node):
    def __init__(self) -> None:
        super().__init__("minimal_publisher")
        self.publisher = self.create_publisher(String, "addison", 10)
        self.create_timer(0.5, self.on_timer)
        self.i = 0

    def on_timer(self) -> None:
        msg = String(data=f"Hi Automatic Addison: {self.i}")
        self.publisher.publish(msg)
        self.get_logger().info(f'Publishing: "{msg.data}"')
        self.i += 1


if __name__ == "__main__":
    callboard.run(MinimalPublisher)
