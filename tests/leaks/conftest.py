"""The context of rclpy's nodes."""

from tests.actors.ros.conftest import context

__all__ = ["context"]
