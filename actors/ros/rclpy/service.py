"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.values import convert_assignments, rosidl_values

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.service.service import Service as NativeService
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")


class Service(ServiceEndpoint["NativeService[Any, Any]"], Generic[RequestT, ResponseT]):
    """Serves requests. Made by `Node.create_service`."""

    def __init__(
        self,
        thread: NodeThread,
        srv_type: Any,
        make: Callable[[Callable[..., Any]], NativeService[Any, Any]],
        callback: Callable[[RequestT, ResponseT], Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(thread, srv_type, callback_group, qos_profile)
        self.callback = callback
        self._native = thread.call(lambda: make(self._handle))
        convert_assignments(srv_type.Response)

    async def _handle(self, request: RequestT) -> ResponseT:
        """Let the executor answer: callboard has at most 1,000 requests of a service handled at once."""
        response: ResponseT = await self.run(self.callback, rosidl_values(request), self.srv_type.Response())
        return response
