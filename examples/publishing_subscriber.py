"""Subscribe to `addison` and repeat each message on `addison2`.

Beside it run `callboard broker`, `python examples/minimal_publisher.py` and `callboard topic echo /addison2`.
"""

import callboard
from actors.interfaces.std_msgs.msg import String


class PublishingSubscriber(callboard.Node):
    def __init__(self) -> None:
        super().__init__("publishing_subscriber")
        self.create_subscription(String, "addison", self.on_message, 10)
        self.publisher = self.create_publisher(String, "addison2", 10)

    def on_message(self, msg: String) -> None:
        heard = String(data=f"I heard {msg.data}")
        self.publisher.publish(heard)
        self.get_logger().info(heard.data)


if __name__ == "__main__":
    callboard.run(PublishingSubscriber)
