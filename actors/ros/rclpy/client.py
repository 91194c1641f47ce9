"""Clients: calls without waiting, and calls that block."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.client.thread_call import ThreadCall
from actors.endpoints.endpoint import endpoint_of
from actors.errors import NodeDestroyed
from actors.interfaces.codec import codec_for
from actors.ros.rclpy.destroyable import Destroyable
from actors.ros.rclpy.exceptions import InvalidHandle, NotInitializedException
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.ros.rclpy.service_endpoint import ServiceEndpoint
from actors.ros.rclpy.task import Future
from actors.ros.rclpy.thread_node import settle
from actors.ros.values import convert_assignments, prepare, rosidl_values
from actors.threads.errors import ThreadStopped
from proto.errors import CallboardError
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from actors.endpoints.client.client import Client as NativeClient
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.qos import QoSProfile


RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")
EventT = TypeVar("EventT")
"""As in rclpy, for annotations."""

__getattr__ = imported_names(
    __name__,
    "CallbackGroup Clock Context QoSProfile ServiceIntrospectionState SrvType SrvTypeRequest SrvTypeResponse",
)


class _Call(ThreadCall):
    """A call of a service; as work of the executor, it completes its future.

    Args:
        client: The client.
        future: The program's.

    Attributes:
        client, future: The same.
        reply: The reply in the loop, if the loop has made the call.
        given_up: Whether its future will not be completed any more.
    """

    __slots__ = ("client", "future", "given_up", "reply")

    def __init__(self, client: Client[Any, Any, Any], future: Future[Any]) -> None:
        super().__init__()
        self.client = client
        self.future = future
        self.reply: asyncio.Future[Any] | None = None
        self.given_up = False

    def completed(self) -> None:
        """Let the executor complete the future, as it runs every callback of ROS 2; in the loop."""
        # As in rclpy, the future of a client that is destroyed stays pending.
        if not isinstance(self.error, NodeDestroyed):
            self.client.enqueue(self)

    def __call__(self) -> None:
        """Complete the future, where the executor spins."""
        if self.given_up:
            return
        self.future.set_executor(self.client.active_executor)
        if self.error is None:
            self.future.set_result(rosidl_values(self.response))
        else:
            self.future.set_exception(self.error)


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
        self._endpoint.accept_threads()
        self._in_loop: set[_Call] = set()
        """Calls that the loop has not begun yet."""
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
        call = self._pending[future] = _Call(self, future)
        # A program that cancels the future has given the call up, as much as one that calls
        # `remove_pending_request`.
        future.when_done(partial(self.remove_pending_request, future))
        # None may overtake those that the loop makes.
        if self._in_loop or not self._endpoint.call_in_thread(body, call):
            self._in_loop.add(call)
            self._thread.post(self._begin, body, call)
        return future

    def _check(self, request: RequestT) -> None:
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(f"Expected a {self.srv_type.Request.__qualname__}, got {request!r}")

    def _begin(self, body: bytes, call: _Call) -> None:
        if call.given_up:
            self._in_loop.discard(call)
            return
        # Without a task in the usual case. A call without a server waits for one; callboard's own would fail
        # at once, which programs written for ROS 2 do not expect.
        if self._native.service_is_ready():
            reply = self._call_now(body)
        else:
            reply = asyncio.ensure_future(self._call(self._codec.decode(body)))
        call.reply = reply
        self._in_loop.discard(call)
        if call.given_up:  # meanwhile, by a thread that has not seen the reply
            reply.cancel()
        reply.add_done_callback(partial(_end, call))

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

    def remove_pending_request(self, future: Future[ResponseT]) -> None:
        """Give a call up: its future will not be completed."""
        call = self._pending.pop(future, None)
        if call is None:
            return
        call.given_up = True
        if call.response is None and call.error is None:
            with suppress(ThreadStopped):
                self._thread.post(self._cancel, call)

    def _cancel(self, *calls: _Call) -> None:
        for call in calls:
            if call.reply is not None:
                call.reply.cancel()
            elif call.number:
                self._endpoint.give_up(call.number)

    def service_is_ready(self) -> bool:
        """Return whether there is a server."""
        with self.handle:
            settle(self._thread)
            return self._native.service_is_ready()

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server.

        Args:
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            Whether there is one; False as well if the context is shut down meanwhile.
        """
        try:
            settle(self._thread)
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
        self._thread.call(lambda: self._cancel(*calls))
        super().destroy()


def _end(call: _Call, reply: asyncio.Future[Any]) -> None:
    if reply.cancelled():
        return
    # Reading the exception also keeps asyncio from reporting it if the program never spins again.
    error = reply.exception()
    if error is None:
        call.set_result(reply.result())
    elif isinstance(error, Exception):
        call.set_exception(error)
