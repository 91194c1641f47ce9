"""What tests read or set inside the rclpy face, where no public name has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.ros import message_classes, values

if TYPE_CHECKING:
    from actors.ros.rclpy.client import Client
    from actors.ros.rclpy.lifecycle import LifecycleNode
    from actors.ros.rclpy.service import Service
    from actors.ros.rclpy.subscription import Subscription


def lifecycle_state(node: LifecycleNode) -> tuple[int, str]:
    """Return the state of a managed node, which rclpy tells by a service only."""
    return node._state_machine.current_state


def forget_numpy() -> None:
    """Forget whether NumPy is there, and what was computed for it."""
    for cached in (message_classes.numpy_module, values._has_conversions, values._conversions):
        cached.cache_clear()


def counted_calls(client: Client[Any, Any, Any]) -> int:
    """Return how many calls the diagnostics of a client count."""
    return client._endpoint.diagnostics().calls


def requests_waiting(service: Service[Any, Any, Any]) -> int:
    """Return how many requests wait for the executor."""
    return len(service._calls)


def counted_messages(subscription: Subscription[Any]) -> tuple[int, int]:
    """Return how many messages a subscription has received, and how many could not be read."""
    native = subscription._native
    return native.received, native.undecodable
