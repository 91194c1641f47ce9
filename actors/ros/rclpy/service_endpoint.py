"""The base of clients and services."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.ros.rclpy.call_endpoint import CallEndpoint

if TYPE_CHECKING:
    from actors.endpoints.client.client import Client as NativeClient
    from actors.endpoints.service.service import ServiceServer as NativeService
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread


NativeT = TypeVar("NativeT", bound="NativeClient[Any, Any] | NativeService[Any, Any]")


class ServiceEndpoint(CallEndpoint, Generic[NativeT]):
    """A client or a service.

    Attributes:
        srv_type: The service class.
        srv_name: The service's name as given, such as "~/stop".
        qos_profile: Its QoS.
    """

    _native: NativeT

    def __init__(
        self,
        thread: NodeThread,
        srv_type: Any,
        srv_name: str,
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(thread, callback_group)
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.qos_profile = qos_profile

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        with self.handle:
            return self._native.srv_name
