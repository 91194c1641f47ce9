"""Publishers, subscriptions, services, clients and timers of an `AsyncNode`, and its clock."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, TypeVar

from actors.errors import NodeDestroyed
from actors.interfaces.message import Message
from actors.ros.process_thread import process_thread
from actors.ros.rclpy.client import Client
from actors.ros.rclpy.clock import ROSClock
from actors.ros.rclpy.entity import Entity
from actors.ros.rclpy.experimental.loop_dispatcher import LoopDispatcher
from actors.ros.rclpy.publisher import Publisher
from actors.ros.rclpy.service import Service
from actors.ros.rclpy.subscription import Subscription
from actors.ros.rclpy.timer import Timer
from actors.ros.values import copied, rosidl_values
from actors.time.clock import Clock as NativeClock
from actors.time.types import ClockType

if TYPE_CHECKING:
    from actors.ros.rclpy.queued_calls import RecentCalls

MsgT = TypeVar("MsgT", bound=Message)
RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT")


class AsyncEntity(Entity):
    """An entity whose callbacks are tasks of the node's loop.

    Attributes:
        concurrent: Whether callbacks run at the same time.
    """

    concurrent = False

    def destroy(self) -> None:
        """Take it out of service; cancel callbacks that run."""
        dispatcher = self.active_executor
        super().destroy()
        if isinstance(dispatcher, LoopDispatcher):
            dispatcher.cancel(self)


class AsyncPublisher(Publisher[MsgT]):
    """A publisher. Made by `AsyncNode.create_publisher`."""


class AsyncSubscription(AsyncEntity, Subscription[MsgT]):
    """A subscription. Made by `AsyncNode.create_subscription`."""


class AsyncService(AsyncEntity, Service[RequestT, ResponseT, Any]):
    """A service. Made by `AsyncNode.create_service`."""


class AsyncClient(AsyncEntity, Client[RequestT, ResponseT, Any]):
    """A client. Made by `AsyncNode.create_client`."""

    async def call(self, request: RequestT) -> ResponseT:  # type: ignore[override]  # as in rclpy
        """Call the service; without a server, wait for one.

        Args:
            request: The request.

        Returns:
            The response.

        Raises:
            TypeError: The request is not of the service's class.
            RuntimeError: The client has been destroyed.
            CancelledError: It is destroyed meanwhile.
            CallFailed: The handler has raised, or the server is gone.
        """
        self._check(request)
        with self.handle:  # raises InvalidHandle, a RuntimeError
            pass
        request = copied(request)
        try:
            response: ResponseT = await asyncio.wrap_future(self._thread.submit(lambda: self._call(request)))
        except NodeDestroyed as error:
            raise asyncio.CancelledError("The client has been destroyed") from error
        return rosidl_values(response)

    async def wait_for_service(self, *, check_interval: float = 0.1) -> None:  # type: ignore[override]
        """Wait for a server, without a limit; the broker reports it at once.

        Args:
            check_interval: Not used.
        """
        del check_interval
        with self.handle:
            pass
        await asyncio.wrap_future(self._thread.submit(lambda: self._native.wait_for_service(None)))


class AsyncTimer(AsyncEntity, Timer):
    """A timer. Made by `AsyncNode.create_timer`."""


class AsyncClock(ROSClock):
    """A clock to await. A node's shows simulated time while its parameter `use_sim_time` is set.

    Args:
        native: The node's clock in callboard; None makes one that no node sets.
        jump_calls: Makes the node's calls of jump callbacks.
        clock_type: STEADY_TIME counts from an arbitrary zero; the others are the wall clock.
    """

    def __init__(
        self,
        native: NativeClock | None = None,
        jump_calls: RecentCalls | None = None,
        *,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        super().__init__(native, jump_calls)
        self._destroyed = False
        if native is None:
            self.native = NativeClock(clock_type)

    def destroy(self) -> None:
        """Refuse further sleeps. Those that run end with the node."""
        self._destroyed = True

    async def sleep(self, duration_sec: float) -> None:
        """Sleep for a number of seconds; zero or less returns soon.

        Args:
            duration_sec: Of simulated time while that is on.

        Raises:
            RuntimeError: The node has been destroyed.
            CancelledError: It is destroyed meanwhile.
            TimeSourceChangedError: Simulated time is switched on or off meanwhile.
        """
        if self._destroyed:
            raise RuntimeError("The clock has been destroyed with its node")
        try:
            await asyncio.wrap_future(process_thread().submit(lambda: self.native.sleep_for(duration_sec)))
        except NodeDestroyed as error:
            raise asyncio.CancelledError("The node has been destroyed") from error
