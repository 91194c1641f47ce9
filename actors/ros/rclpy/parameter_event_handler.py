"""Callbacks for the parameters of any node. They get messages, as rclpy's do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.parameter_client.event_handler import ParameterCallbackHandle, ParameterEventCallbackHandle
from actors.ros.rclpy.qos import QoSProfile, qos_profile_parameter_events
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
    from actors.ros.rclpy.node import Node

__getattr__ = imported_names(
    __name__, "CallbackGroup Node Parameter QoSOverridingOptions SubscriptionEventCallbacks"
)


class ParameterEventHandler:
    """Calls functions when parameters change; the last one added is called first.

    Args:
        node: The node that subscribes to `/parameter_events`.
        qos_profile: The subscription's QoS.
        options: Further arguments of `Node.create_subscription`.

    Attributes:
        node: The node.
        qos_profile: The subscription's QoS.
        parameter_event_subscription: The subscription.
    """

    def __init__(
        self, node: Node, qos_profile: QoSProfile = qos_profile_parameter_events, **options: Any
    ) -> None:
        self.node = node
        self.qos_profile = qos_profile
        self._parameter_callbacks: list[ParameterCallbackHandle] = []
        self._event_callbacks: list[ParameterEventCallbackHandle] = []
        self.parameter_event_subscription = node.create_subscription(
            ParameterEvent, "/parameter_events", self._on_event, qos_profile, **options
        )

    def destroy(self) -> None:
        """Call no function any more."""
        self.node.destroy_subscription(self.parameter_event_subscription)

    @staticmethod
    def get_parameter_from_event(
        event: ParameterEvent, parameter_name: str, node_name: str
    ) -> ParameterMessage | None:
        """Return the message of one parameter of a node; None if the event gives it no value."""
        if event.node != node_name:
            return None
        found = ParameterEventHandler.get_parameters_from_event(event)
        return next((each for each in found if each.name == parameter_name), None)

    @staticmethod
    def get_parameters_from_event(event: ParameterEvent) -> Iterable[ParameterMessage]:
        """Yield the messages of the parameters that an event gives values."""
        yield from event.new_parameters
        yield from event.changed_parameters

    def add_parameter_callback(
        self, parameter_name: str, node_name: str, callback: Callable[[Any], object]
    ) -> ParameterCallbackHandle:
        """Call a function whenever a parameter gets a value.

        Args:
            parameter_name: The parameter's name.
            node_name: Its node: "" is the handler's own; relative to its namespace without a slash.
            callback: Gets the message of the parameter.

        Returns:
            A handle for `remove_parameter_callback`.
        """
        handle = ParameterCallbackHandle(parameter_name, self._full_name(node_name), callback)
        self._parameter_callbacks.insert(0, handle)
        return handle

    def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None:
        """Undo `add_parameter_callback`; raise RuntimeError if that has been done."""
        _remove(self._parameter_callbacks, handle)

    def add_parameter_event_callback(
        self, callback: Callable[[ParameterEvent], object]
    ) -> ParameterEventCallbackHandle:
        """Call a function for every event; return a handle for `remove_parameter_event_callback`."""
        handle = ParameterEventCallbackHandle(callback)
        self._event_callbacks.insert(0, handle)
        return handle

    def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None:
        """Undo `add_parameter_event_callback`; raise RuntimeError if that has been done."""
        _remove(self._event_callbacks, handle)

    def _full_name(self, node_name: str) -> str:
        if not node_name:
            return self.node.get_fully_qualified_name()
        return self.node.resolve_service_name(node_name, only_expand=True)

    def _on_event(self, event: ParameterEvent) -> None:
        values = {each.name: each for each in self.get_parameters_from_event(event)}
        # A copy, since a callback may add or remove callbacks.
        for handle in tuple(self._parameter_callbacks):
            if handle.node_name == event.node and handle.parameter_name in values:
                handle.callback(values[handle.parameter_name])  # type: ignore[arg-type]  # rclpy's gets messages
        for each in tuple(self._event_callbacks):
            each.callback(event)


def _remove(handles: list[Any], handle: object) -> None:
    try:
        handles.remove(handle)
    except ValueError:
        raise RuntimeError("Callback doesn't exist: it has been removed already") from None
