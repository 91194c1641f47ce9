"""The base of what calls or is called: clients and servers, of services and of actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.ros.rclpy.queued_calls import QueuedCalls

if TYPE_CHECKING:
    from actors.endpoints.service_introspection import ServiceIntrospectionState
    from actors.ros.rclpy.clock import Clock
    from actors.ros.rclpy.qos import QoSProfile


class CallEndpoint(QueuedCalls):
    """A client or a server; `_native` is callboard's."""

    _native: Any

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
