"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.service.late_reply import LateReply
from actors.interfaces.codec import codec_for
from actors.ros.rclpy.entity import destroy_with, weakly
from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.values import convert_assignments, rosidl_values
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

__getattr__ = imported_names(
    __name__,
    "CallbackGroup Clock QoSProfile ServiceIntrospectionState SrvType SrvTypeRequest SrvTypeResponse",
)


class RequestHeader(LateReply):
    """Which request a response is for; as work of the executor, it calls the handler.

    Args:
        service: The service.
        request: The request.

    Attributes:
        request: The request.
        body: The encoded response; None until there is one.
    """

    __slots__ = ("_server", "body", "request")

    def __init__(self, service: Service[Any, Any, Any], request: Any) -> None:
        super().__init__()
        self._server = service
        self.request = request
        self.body: bytes | None = None

    def begun(self) -> None:
        """Let the executor answer; in the loop. callboard has at most 1,000 requests handled at once."""
        self._server.answer_soon(self)

    def __call__(self) -> Any:
        """Answer the request, where the executor spins; return a coroutine that does, or None.

        If the handler raises, this does, and the caller gets the error.
        """
        if self.ended:
            return None
        try:
            response = self._server.callback(rosidl_values(self.request), self._server.srv_type.Response())
            if inspect.iscoroutine(response):
                return self._send_later(response)
            self._send(response)
        except BaseException as error:
            self.fail(error)
            raise
        return None

    async def _send_later(self, response: Coroutine[Any, Any, Any]) -> None:
        try:
            self._send(await response)
        except BaseException as error:
            self.fail(error)
            raise

    def _send(self, response: Any) -> None:
        self._server.send_response(response, self)
        if self.body is None:  # a program's own `send_response`
            self.fail(TypeError(f"There is no response of {self._server.service_name}"))
        else:
            self.send(self.body)


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

    def _handle(self, request: RequestT) -> RequestHeader:
        return RequestHeader(self, request)

    def answer_soon(self, header: RequestHeader) -> None:
        """Call the handler where the executor spins; in the loop."""
        if self._given_up:
            header.cancel()
        else:
            self.enqueue(header)

    def give_up(self) -> None:
        """Cancel the requests that wait for an answer, later ones, too. In the loop."""
        super().give_up()
        self._endpoint.cancel_all_late()

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
