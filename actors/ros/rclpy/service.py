"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

from actors.ros.rclpy.queued_calls import QueuedCalls

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from actors.endpoints.service.service import Service as NativeService
    from actors.endpoints.service_introspection import ServiceIntrospectionState
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.clock import Clock
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")


class Service(QueuedCalls, Generic[RequestT, ResponseT]):
    """Serves requests. Made by `Node.create_service`.

    Attributes:
        srv_type: The service class.
        srv_name: The full name of the service.
        qos_profile: As given.
    """

    def __init__(
        self,
        thread: NodeThread,
        srv_type: Any,
        make: Callable[[Callable[..., Any]], NativeService[Any, Any]],
        callback: Callable[[RequestT, ResponseT], Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(thread, callback_group)
        self.srv_type = srv_type
        self.qos_profile = qos_profile
        self.callback = callback
        self._native = thread.call(lambda: make(self._handle))
        self.srv_name = self._native.srv_name

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        return self.srv_name

    async def _handle(self, request: RequestT) -> ResponseT:
        """Let the executor answer: callboard has at most 1,000 requests of a service handled at once."""
        response: ResponseT = await self.run(self.callback, request, self.srv_type.Response())
        return response

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Publish events of calls, or stop doing so."""
        self._thread.call(
            lambda: self._native.configure_introspection(
                clock.native, service_event_qos_profile.native(), introspection_state
            )
        )

    def destroy(self) -> None:
        """Take the service out of service; callers that wait get an error."""
        self._thread.call(self._native.destroy)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.destroy()
