"""Publishers of a lifecycle node."""

from __future__ import annotations

from typing import Any, TypeVar

from actors.interfaces.message import Message
from actors.ros.rclpy.lifecycle.managed_entity import SimpleManagedEntity
from actors.ros.rclpy.publisher import Publisher

MsgT = TypeVar("MsgT", bound=Message)


class LifecyclePublisher(SimpleManagedEntity, Publisher[MsgT]):
    """A publisher that is silent unless it is activated. Made by `create_lifecycle_publisher`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        SimpleManagedEntity.__init__(self)
        super(SimpleManagedEntity, self).__init__(*args, **kwargs)

    def publish(self, msg: MsgT | bytes) -> None:
        """Send a message as `Publisher.publish` does; do nothing unless activated."""
        if self.is_activated:
            base: type[Publisher[MsgT]] = Publisher  # a test may replace the method there, as with rclpy
            base.publish(self, msg)
