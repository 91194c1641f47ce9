"""Clients: calls without waiting, and calls that block."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.endpoint import endpoint_of
from actors.errors import NodeDestroyed
from actors.interfaces.codec import codec_for
from actors.ros.rclpy.destroyable import Destroyable
from actors.ros.rclpy.exceptions import InvalidHandle, NotInitializedException
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.rclpy.task import Future
from actors.ros.values import convert_assignments, prepare, rosidl_values
from actors.threads.errors import ThreadStopped
from proto.errors import CallboardError
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from actors.endpoints.client.client import Client as NativeClient
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.qos import QoSProfile


class _Call:
    """A call of a service.

    Attributes:
        reply: The reply in the loop; None before the call is made there.
        given_up: Whether its future will not be completed any more.
    """

    __slots__ = ("given_up", "reply")

    def __init__(self) -> None:
        self.reply: asyncio.Future[Any] | None = None
        self.given_up = False


RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")
EventT = TypeVar("EventT")
"""As in rclpy, for annotations."""

__getattr__ = imported_names(
    __name__,
    "CallbackGroup Clock Context QoSProfile ServiceIntrospectionState SrvType SrvTypeRequest SrvTypeResponse",
)


class Client(ServiceEndpoint["NativeClient[Any, Any]"], Generic[RequestT, ResponseT, EventT]):
    """Calls a service. Made by `Node.create_client`."""

    def __init__(
        self,
        context: Context,
        srv_type: Any,
        srv_name: str,
        native: NativeClient[Any, Any],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(context.thread, srv_type, srv_name, callback_group, qos_profile)
        convert_assignments(srv_type.Request)
        prepare(srv_type.Response)
        self.context = context
        self._native = native
        # Both are looked up once: requests are encoded in the calling thread, and sent by the loop.
        self._endpoint = endpoint_of(native)
        self._codec = codec_for(srv_type.Request)
        self._pending: dict[Future[ResponseT], _Call] = {}
        """Without a lock: a signal handler that holds it may wait for the loop, which would wait for it."""

    def call(self, request: RequestT, timeout_sec: float | None = None) -> ResponseT:
        """Call the service and wait for the response, in any thread, in callbacks, too.

        Args:
            request: The request.
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            The response.

        Raises:
            TypeError: The request is not of the service's class.
            TimeoutError: There was no response in time.
            ExternalShutdownException: The context has ended meanwhile.
            CallFailed: The handler has raised, or the server is gone.
        """
        self._check(request)
        response: ResponseT = self.context.wait(lambda: self._call(request), timeout_sec)
        return rosidl_values(response)

    async def _call(self, request: Any) -> Any:
        """Wait for a server, and call it; in the loop."""
        await self._native.wait_for_service(None)
        return await self._native.call_async(request, None)

    def call_async(self, request: RequestT) -> Future[ResponseT]:
        """Call the service without waiting. Without a server the call waits for one.

        Args:
            request: The request.

        Returns:
            A future of the response, which is completed by the thread that spins.

        Raises:
            TypeError: The request is not of the service's class.
            InvalidMessageError: A field has a wrong type or is out of range.
            InvalidHandle: The client has been destroyed.
        """
        self._check(request)
        if self._is_destroyed:
            raise InvalidHandle("The client has been destroyed")
        # Here, and not later in the loop: the program may change the request in the meantime.
        body = self._codec.encode(request)
        future: Future[ResponseT] = Future()  # `Future[ResponseT]()` takes 1 us longer
        call = self._pending[future] = _Call()
        # A program that cancels the future has given the call up, as much as one that calls
        # `remove_pending_request`.
        future.when_done(partial(self.remove_pending_request, future))
        # One call is faster from this thread. Many at a time are cheaper in one frame, which the loop makes;
        # and none may overtake those before it.
        if len(self._pending) == 1:
            call.reply = self._endpoint.call_now(body, partial(self._call_ended, future, call))
        if call.reply is None:
            self._thread.post(self._begin, body, future, call)
        return future

    def _check(self, request: RequestT) -> None:
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(f"Expected a {self.srv_type.Request.__qualname__}, got {request!r}")

    def _begin(self, body: bytes, future: Future[ResponseT], call: _Call) -> None:
        if call.given_up:
            return
        # Without a task in the usual case. A call without a server waits for one; callboard's own would fail
        # at once, which programs written for ROS 2 do not expect.
        if self._native.service_is_ready():
            reply = self._call_now(body)
        else:
            reply = asyncio.ensure_future(self._call(self._codec.decode(body)))
        call.reply = reply
        if call.given_up:  # meanwhile, by a thread that has not seen the reply
            reply.cancel()
        reply.add_done_callback(partial(self._call_ended, future, call))

    def _call_now(self, body: bytes) -> asyncio.Future[Any]:
        endpoint = self._endpoint
        try:
            endpoint.require_alive()
            endpoint.context.link.require_fits(f"A request of '{self.srv_name}'", len(body))
            # Only events of the service have the message.
            request: Any = None if endpoint.service_events is None else self._codec.decode(body)
            return endpoint.call(request, body, inf)
        except CallboardError as error:
            failed: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
            failed.set_exception(error)
            return failed

    def _call_ended(self, future: Future[ResponseT], call: _Call, reply: asyncio.Future[ResponseT]) -> None:
        # Reading the exception also keeps asyncio from reporting it if the program never spins again.
        if reply.cancelled() or isinstance(reply.exception(), NodeDestroyed):
            return  # as in rclpy, the future of a client that is destroyed stays pending
        # Completed where the executor spins, like every callback of ROS 2.
        self.enqueue(partial(self._complete, future, call, reply))

    def _complete(self, future: Future[ResponseT], call: _Call, reply: asyncio.Future[ResponseT]) -> None:
        if call.given_up:
            return
        future.set_executor(self.active_executor)
        error = reply.exception()
        if error is None:
            future.set_result(rosidl_values(reply.result()))
        else:
            future.set_exception(error)

    def remove_pending_request(self, future: Future[ResponseT]) -> None:
        """Give a call up: its future will not be completed."""
        call = self._pending.pop(future, None)
        if call is None:
            return
        call.given_up = True
        if call.reply is not None and not call.reply.done():
            with suppress(ThreadStopped):
                self._thread.post(call.reply.cancel)

    def service_is_ready(self) -> bool:
        """Return whether there is a server."""
        with self.handle:
            return self._native.service_is_ready()

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server.

        Args:
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            Whether there is one; False as well if the context is shut down meanwhile.
        """
        try:
            return self.context.wait(lambda: self._native.wait_for_service(timeout_sec))
        except (ExternalShutdownException, NotInitializedException):
            return False

    def destroy(self) -> None:
        """Take the client out of service; calls in flight are given up."""
        Destroyable.destroy(self)  # no further call begins
        calls = list[_Call]()
        while self._pending:
            call = self._pending.popitem()[1]
            call.given_up = True
            calls.append(call)
        # In the loop, and waited for: after this nothing of the calls runs any more.
        self._thread.call(lambda: [each.reply.cancel() for each in calls if each.reply is not None])
        super().destroy()
