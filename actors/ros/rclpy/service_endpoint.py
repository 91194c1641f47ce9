"""The base of clients and services."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.ros.rclpy.queued_calls import QueuedCalls

if TYPE_CHECKING:
    from actors.endpoints.client.client import Client as NativeClient
    from actors.endpoints.service.service import ServiceServer as NativeService
    from actors.endpoints.service_introspection import ServiceIntrospectionState
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.clock import Clock
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread


NativeT = TypeVar("NativeT", bound="NativeClient[Any, Any] | NativeService[Any, Any]")


class ServiceEndpoint(QueuedCalls, Generic[NativeT]):
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

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Publish events of calls on `<service>/_service_event`, or stop doing so."""
        self._thread.call(
            lambda: self._native.configure_introspection(
                clock.native, service_event_qos_profile.native(), introspection_state
            )
        )

    def destroy(self) -> None:
        """Take it out of service; calls that wait get an error."""
        super().destroy()
        self._thread.call(self._native.destroy)
