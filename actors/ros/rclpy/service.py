"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.codec import codec_for
from actors.ros.rclpy.entity import destroy_with, weakly
from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.values import convert_assignments, rosidl_values
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Coroutine

    from actors.endpoints.service.service import ServiceServer as NativeService
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.qos import QoSProfile
    from actors.threads.node_thread import NodeThread

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")
EventT = TypeVar("EventT")
"""As in rclpy, for annotations."""

__getattr__ = imported_names(
    __name__,
    "CallbackGroup Clock QoSProfile ServiceIntrospectionState SrvType SrvTypeRequest SrvTypeResponse",
)


class RequestHeader:
    """Which request a response is for.

    Attributes:
        body: The encoded response; None until there is one.
    """

    __slots__ = ("body",)

    def __init__(self) -> None:
        self.body: bytes | None = None


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
        self._native = thread.call(lambda: make(weakly(self._handle)))
        self._endpoint = endpoint_of(self._native)
        self._codec = codec_for(srv_type.Response)
        destroy_with(self, thread, self._native.destroy)
        convert_assignments(srv_type.Response)

    def _handle(self, request: RequestT) -> asyncio.Future[ResponseT]:
        """Let the executor answer: callboard has at most 1,000 requests of a service handled at once."""
        return self.answer_of(self._respond, request, RequestHeader())

    def _answer(self, answer: asyncio.Future[Any], result: Any, error: BaseException | None) -> None:
        if error is None and result is not None:  # None: a program's own `send_response`
            if self._endpoint.reply_now(answer, result):
                self._unanswered.pop(answer, None)
                return
            result = self._codec.decode(result)
        super()._answer(answer, result, error)

    def _respond(self, request: RequestT, header: RequestHeader) -> Any:
        response = self.callback(rosidl_values(request), self.srv_type.Response())
        if inspect.iscoroutine(response):
            return self._respond_later(response, header)
        self.send_response(response, header)
        return header.body

    async def _respond_later(self, response: Coroutine[Any, Any, ResponseT], header: RequestHeader) -> Any:
        self.send_response(await response, header)
        return header.body

    def send_response(self, response: ResponseT, header: RequestHeader) -> None:
        """Answer a request. Called with what the handler returns; programs may replace it.

        Args:
            response: The response.
            header: Which request it is for.

        Raises:
            TypeError: The response is not of the service's class.
        """
        if not isinstance(response, self.srv_type.Response):
            raise TypeError(
                f"The handler of {self.service_name} returned {response!r},"
                f" not a {self.srv_type.Response.__qualname__}"
            )
        header.body = self._codec.encode(response)  # now: the handler may change it later
