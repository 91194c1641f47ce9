"""Calls functions when the parameters of any node change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from actors.callbacks.functions import as_coroutine
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.parameters.types import Parameter
from actors.qos.profile import qos_profile_parameter_events

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.node.node import Node
    from actors.qos.profile import QoSProfile

ParameterCallback: TypeAlias = "Callable[[Parameter], Any]"
ParameterEventCallback: TypeAlias = "Callable[[ParameterEvent], Any]"


@dataclass(frozen=True, eq=False, slots=True)
class ParameterCallbackHandle:
    """A callback for one parameter, to remove it with.

    Attributes:
        parameter_name: The parameter's name.
        node_name: The full name of its node.
        callback: The callback.
    """

    parameter_name: str
    node_name: str
    callback: ParameterCallback


@dataclass(frozen=True, eq=False, slots=True)
class ParameterEventCallbackHandle:
    """A callback for all events, to remove it with.

    Attributes:
        callback: The callback.
    """

    callback: ParameterEventCallback


class ParameterEventHandler:
    """Callbacks for the parameters of any node, on one subscription to `/parameter_events`.

    Callbacks are `def` or `async def`, and run like those of a subscription; the last one added is called
    first. If some raise, the others are called all the same.

    Args:
        node: The node that subscribes.
        qos_profile: The subscription's QoS.
    """

    def __init__(self, node: Node, qos_profile: QoSProfile = qos_profile_parameter_events) -> None:
        self._node = node
        self._parameter_callbacks: list[ParameterCallbackHandle] = []
        self._event_callbacks: list[ParameterEventCallbackHandle] = []
        self._subscription = node.create_subscription(
            ParameterEvent, "/parameter_events", self._on_event, qos_profile
        )

    def add_parameter_callback(
        self, parameter_name: str, node_name: str, callback: ParameterCallback
    ) -> ParameterCallbackHandle:
        """Call a function whenever a parameter gets a value.

        Args:
            parameter_name: The parameter's name.
            node_name: Its node: "" is the handler's own; relative to its namespace without a slash.
            callback: Gets the parameter.

        Returns:
            A handle for `remove_parameter_callback`.

        Raises:
            InvalidServiceNameError: The node's name breaks the naming rules.
        """
        handle = ParameterCallbackHandle(parameter_name, self._full_name(node_name), callback)
        self._parameter_callbacks.insert(0, handle)
        return handle

    def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None:
        """Undo `add_parameter_callback`.

        Args:
            handle: The handle that it returned.

        Raises:
            ValueError: It has been removed already.
        """
        self._parameter_callbacks.remove(handle)

    def add_parameter_event_callback(self, callback: ParameterEventCallback) -> ParameterEventCallbackHandle:
        """Call a function for every event: all parameters of all nodes, removed ones too.

        Args:
            callback: Gets the `ParameterEvent`.

        Returns:
            A handle for `remove_parameter_event_callback`.
        """
        handle = ParameterEventCallbackHandle(callback)
        self._event_callbacks.insert(0, handle)
        return handle

    def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None:
        """Undo `add_parameter_event_callback`.

        Args:
            handle: The handle that it returned.

        Raises:
            ValueError: It has been removed already.
        """
        self._event_callbacks.remove(handle)

    @staticmethod
    def get_parameters_from_event(event: ParameterEvent) -> list[Parameter]:
        """Return the parameters that an event gives values.

        Args:
            event: The event.

        Returns:
            New and changed parameters, without those of an unknown type.
        """
        found: list[Parameter] = []
        for message in (*event.new_parameters, *event.changed_parameters):
            try:
                found.append(Parameter.from_parameter_msg(message))
            # A type that a later version of ROS may have. The other parameters of the event are still of
            # use.
            except ValueError:
                continue
        return found

    @staticmethod
    def get_parameter_from_event(
        event: ParameterEvent, parameter_name: str, node_name: str
    ) -> Parameter | None:
        """Return one parameter of an event.

        Args:
            event: The event.
            parameter_name: The parameter's name.
            node_name: The full name of its node.

        Returns:
            The parameter; None if the event is another node's, or gives it no value.
        """
        found = ParameterEventHandler.get_parameters_from_event(event) if event.node == node_name else []
        return next((each for each in found if each.name == parameter_name), None)

    def destroy(self) -> None:
        """Take the subscription out of service; no callback is called any more."""
        self._subscription.destroy()

    def _full_name(self, node_name: str) -> str:
        if not node_name:
            return self._node.get_fully_qualified_name()
        return self._node.resolve_service_name(node_name, only_expand=True)

    def _on_event(self, event: ParameterEvent) -> Coroutine[Any, Any, None] | None:
        values = {each.name: each for each in self.get_parameters_from_event(event)}
        # Collected first, because a callback may add or remove callbacks.
        calls: list[tuple[Callable[..., Any], object]] = [
            (handle.callback, values[handle.parameter_name])
            for handle in self._parameter_callbacks
            if handle.node_name == event.node and handle.parameter_name in values
        ]
        calls += [(handle.callback, event) for handle in self._event_callbacks]
        errors: list[Exception] = []
        coroutines: list[Any] = []
        for callback, argument in calls:
            try:
                # All are called before the first is awaited: plain callbacks do not wait for those that do.
                coroutines.append(as_coroutine(callback(argument)))
            except Exception as error:  # noqa: BLE001 - the user's; raised after the others
                errors.append(error)
        waiting = [each for each in coroutines if each is not None]
        if waiting:
            return _finish(waiting, errors)
        _raise(errors)
        return None


async def _finish(coroutines: list[Coroutine[Any, Any, object]], errors: list[Exception]) -> None:
    try:
        for coroutine in coroutines:
            try:
                await coroutine
            except Exception as error:  # noqa: BLE001 - the user's; raised after the others
                errors.append(error)
    finally:  # cancelled: those that are left do not run
        for coroutine in coroutines:
            coroutine.close()
    _raise(errors)


def _raise(errors: list[Exception]) -> None:
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise ExceptionGroup("Callbacks for parameters have raised", errors)
