"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.values import convert_assignments, copied, rosidl_values
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.endpoints.service.service import ServiceServer as NativeService
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")
EventT = TypeVar("EventT")
"""As in rclpy, for annotations."""

__getattr__ = imported_names(__name__, "CallbackGroup Clock QoSProfile ServiceIntrospectionState")


class Service(ServiceEndpoint["NativeService[Any, Any]"], Generic[RequestT, ResponseT, EventT]):
    """Serves requests. Made by `Node.create_service`."""

    def __init__(
        self,
        thread: NodeThread,
        srv_type: Any,
        srv_name: str,
        make: Callable[[Callable[..., Any]], NativeService[Any, Any]],
        callback: Callable[[RequestT, ResponseT], Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(thread, srv_type, srv_name, callback_group, qos_profile)
        self.callback = callback
        self._native = thread.call(lambda: make(self._handle))
        convert_assignments(srv_type.Response)

    async def _handle(self, request: RequestT) -> ResponseT:
        """Let the executor answer: callboard has at most 1,000 requests of a service handled at once."""
        response: ResponseT = await self.run(self._respond, request)
        return response

    def _respond(self, request: RequestT) -> Any:
        response = self.callback(rosidl_values(request), self.srv_type.Response())
        return self._respond_later(response) if inspect.iscoroutine(response) else self._checked(response)

    async def _respond_later(self, response: Coroutine[Any, Any, ResponseT]) -> ResponseT:
        return self._checked(await response)

    def _checked(self, response: ResponseT) -> ResponseT:
        """Return what to send: the handler may change its response after it has returned it."""
        if not isinstance(response, self.srv_type.Response):
            raise TypeError(
                f"The handler of {self.service_name} returned {response!r},"
                f" not a {self.srv_type.Response.__qualname__}"
            )
        return copied(response)
