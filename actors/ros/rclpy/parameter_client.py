"""The parameters of another node."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from actors.interfaces.rcl_interfaces import srv
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.ros.rclpy.parameter import Parameter, parameter_dict_from_yaml_file
from actors.ros.rclpy.qos import QoSProfile, qos_profile_parameter_events, qos_profile_services_default
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.client import Client
    from actors.ros.rclpy.node import Node
    from actors.ros.rclpy.subscription import Subscription
    from actors.ros.rclpy.task import Future

__getattr__ = imported_names(
    __name__,
    "CallbackGroup DescribeParameters Future GetParameterTypes GetParameters ListParameters "
    "MessageInfo Node QoSOverridingOptions SetParameters SetParametersAtomically Subscription "
    "SubscriptionEventCallbacks",
)


class AsyncParameterClient:
    """Reads and sets the parameters of another node.

    Each method sends one request, and returns a future of the response. `callback` gets the future when it
    is done.

    Args:
        node: The node that asks.
        remote_node_name: The other node; relative to the namespace of `node` without a slash.
        qos_profile: As for `Node.create_client`.
        callback_group: As for `Node.create_client`.

    Attributes:
        node: The node that asks.
        remote_node_name: The other node's name, as given.
    """

    def __init__(
        self,
        node: Node,
        remote_node_name: str,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        def client(srv_type: Any, name: str) -> Client[Any, Any, Any]:
            return node.create_client(
                srv_type,
                f"{remote_node_name}/{name}",
                qos_profile=qos_profile,
                callback_group=callback_group,
            )

        self.node = node
        self.remote_node_name = remote_node_name
        self._get = client(srv.GetParameters, "get_parameters")
        self._list = client(srv.ListParameters, "list_parameters")
        self._set = client(srv.SetParameters, "set_parameters")
        self._get_types = client(srv.GetParameterTypes, "get_parameter_types")
        self._describe = client(srv.DescribeParameters, "describe_parameters")
        self._set_atomically = client(srv.SetParametersAtomically, "set_parameters_atomically")

    def _clients(self) -> tuple[Client[Any, Any, Any], ...]:
        return (
            self._get, self._list, self._set, self._get_types, self._describe, self._set_atomically
        )  # fmt: skip

    def services_are_ready(self) -> bool:
        """Return whether the other node serves its parameters now."""
        return all(each.service_is_ready() for each in self._clients())

    def wait_for_services(self, timeout_sec: float | None = None) -> bool:
        """Wait until the other node serves its parameters.

        Args:
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            Whether it does.
        """
        # One deadline for all six services.
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        return all(
            each.wait_for_service(None if end is None else max(0.0, end - time.monotonic()))
            for each in self._clients()
        )

    def list_parameters(
        self,
        prefixes: Sequence[str] | None = None,
        depth: int | None = None,
        callback: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """Ask for the names below prefixes, down to a number of levels; None for all."""
        request = srv.ListParameters.Request(prefixes=[*(prefixes or ())], depth=depth or 0)
        return _call(self._list, request, callback)

    def get_parameters(
        self, names: Sequence[str], callback: Callable[[Any], object] | None = None
    ) -> Future[Any]:
        """Ask for values."""
        return _call(self._get, srv.GetParameters.Request(names=[*names]), callback)

    def get_parameter_types(
        self, names: Sequence[str], callback: Callable[[Any], object] | None = None
    ) -> Future[Any]:
        """Ask for types."""
        return _call(self._get_types, srv.GetParameterTypes.Request(names=[*names]), callback)

    def describe_parameters(
        self, names: Sequence[str], callback: Callable[[Any], object] | None = None
    ) -> Future[Any]:
        """Ask for descriptors."""
        return _call(self._describe, srv.DescribeParameters.Request(names=[*names]), callback)

    def set_parameters(
        self,
        parameters: Sequence[Parameter | ParameterMessage],
        callback: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """Set parameters one by one."""
        return _call(self._set, srv.SetParameters.Request(parameters=_messages(parameters)), callback)

    def set_parameters_atomically(
        self,
        parameters: Sequence[Parameter | ParameterMessage],
        callback: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """Set all parameters, or none."""
        request = srv.SetParametersAtomically.Request(parameters=_messages(parameters))
        return _call(self._set_atomically, request, callback)

    def delete_parameters(
        self, names: Sequence[str], callback: Callable[[Any], object] | None = None
    ) -> Future[Any]:
        """Remove parameters, whose type must be dynamic."""
        return self.set_parameters([Parameter(name) for name in names], callback)

    def load_parameter_file(
        self,
        parameter_file: str,
        use_wildcard: bool = False,
        callback: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """Set the parameters of a file, those of all its nodes, one by one."""
        # rclpy does not look for the other node's name in the file either: what a file has for any node is
        # set.
        parameters = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters([*parameters.values()], callback)

    def load_parameter_file_atomically(
        self,
        parameter_file: str,
        use_wildcard: bool = False,
        callback: Callable[[Any], object] | None = None,
    ) -> Future[Any]:
        """Set all parameters of a file, those of all its nodes, or none."""
        parameters = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters_atomically([*parameters.values()], callback)

    def on_parameter_event(
        self,
        callback: Callable[..., Any],
        qos_profile: QoSProfile = qos_profile_parameter_events,
        **options: Any,
    ) -> Subscription[ParameterEvent]:
        """Subscribe to the changes of all nodes' parameters; options as for `Node.create_subscription`."""
        return self.node.create_subscription(
            ParameterEvent, "/parameter_events", callback, qos_profile, **options
        )


def _messages(parameters: Sequence[Parameter | ParameterMessage]) -> list[ParameterMessage]:
    return [each.to_parameter_msg() if isinstance(each, Parameter) else each for each in parameters]


def _call(
    client: Client[Any, Any, Any], request: Any, callback: Callable[[Any], object] | None
) -> Future[Any]:
    future = client.call_async(request)
    if callback is not None:
        future.add_done_callback(callback)
    return future
