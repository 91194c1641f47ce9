"""The earlier name of `event_handler`."""

from __future__ import annotations

from actors.ros.rclpy.event_handler import PublisherEventCallbacks as PublisherEventCallbacks
from actors.ros.rclpy.event_handler import SubscriptionEventCallbacks as SubscriptionEventCallbacks
