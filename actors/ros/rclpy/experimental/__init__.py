"""What rclpy tries out."""

from __future__ import annotations

from actors.ros.rclpy.experimental.async_entities import AsyncClient as AsyncClient
from actors.ros.rclpy.experimental.async_entities import AsyncClock as AsyncClock
from actors.ros.rclpy.experimental.async_entities import AsyncPublisher as AsyncPublisher
from actors.ros.rclpy.experimental.async_entities import AsyncService as AsyncService
from actors.ros.rclpy.experimental.async_entities import AsyncSubscription as AsyncSubscription
from actors.ros.rclpy.experimental.async_entities import AsyncTimer as AsyncTimer
from actors.ros.rclpy.experimental.async_node import AsyncNode as AsyncNode
from actors.ros.rclpy.experimental.events_executor import EventsExecutor as EventsExecutor
