"""Subscribe to the topic `addison` and log each message.

Beside it run `callboard broker` and `python examples/minimal_publisher.py`.
"""

import callboard
from actors.interfaces.std_msgs.msg import String


class MinimalSubscriber(callboard.Node):
    def __init__(self) -> None:
        super().__init__("minimal_subscriber")
        self.create_subscription(String, "addison", self.on_message, 10)

    def on_message(self, msg: String) -> None:
        self.get_logger().info(f'I heard: "{msg.data}"')


if __name__ == "__main__":
    callboard.run(MinimalSubscriber)
