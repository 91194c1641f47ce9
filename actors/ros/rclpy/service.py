"""Services: requests wait at the node, and the thread that spins handles them."""

from __future__ import annotations

import asyncio
import inspect
from collections import deque
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

from actors.ros.rclpy.entity import Entity
from actors.threads.errors import ThreadStoppedError

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


class Service(Entity, Generic[RequestT, ResponseT]):
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
        super().__init__(callback_group)
        self.srv_type = srv_type
        self.qos_profile = qos_profile
        self.callback = callback
        self._thread = thread
        self._requests: deque[tuple[RequestT, asyncio.Future[ResponseT]]] = deque()
        """At most 1,000: what the service handles at the same time."""
        self._native = thread.call(lambda: make(self._handle))
        self.srv_name = self._native.srv_name

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        return self.srv_name

    async def _handle(self, request: RequestT) -> ResponseT:
        """Wait for the thread that spins to answer; in the loop."""
        answer: asyncio.Future[ResponseT] = asyncio.get_running_loop().create_future()
        self._requests.append((request, answer))
        self.notify()
        return await answer

    def has_work(self) -> bool:
        """Return whether a request waits."""
        return bool(self._requests)

    def take(self) -> Callable[[], Any] | None:
        """Return a call of the callback with the next request, which sends its response."""
        while self._requests:
            request, answer = self._requests.popleft()
            if not answer.done():  # its caller has given up
                return lambda: self._serve(request, answer)
        return None

    def _serve(self, request: RequestT, answer: asyncio.Future[ResponseT]) -> Any:
        try:
            result = self.callback(request, self.srv_type.Response())
        except BaseException as error:
            self._reply(answer, None, error)
            raise
        if inspect.iscoroutine(result):
            return self._serve_later(result, answer)
        self._reply(answer, result, None)
        return None

    async def _serve_later(self, coroutine: Any, answer: asyncio.Future[ResponseT]) -> None:
        try:
            result = await coroutine
        except BaseException as error:
            self._reply(answer, None, error)
            raise
        self._reply(answer, result, None)

    def _reply(self, answer: asyncio.Future[ResponseT], result: Any, error: BaseException | None) -> None:
        try:
            self._thread.post(_answer, answer, result, error)
        except ThreadStoppedError:  # the context has been shut down, and the caller knows
            return

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


def _answer(answer: asyncio.Future[Any], result: Any, error: BaseException | None) -> None:
    if answer.done():
        return
    if error is None:
        answer.set_result(result)
    else:
        answer.set_exception(error if isinstance(error, Exception) else RuntimeError(repr(error)))
