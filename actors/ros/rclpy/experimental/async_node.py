"""Nodes whose callbacks run in an asyncio loop, without an executor, as in ROS 2 Lyrical."""

from __future__ import annotations

import asyncio
import inspect
import weakref
from typing import TYPE_CHECKING, Any, Self, cast

from actors.ros.rclpy.client import Client
from actors.ros.rclpy.clock import ROSClock
from actors.ros.rclpy.experimental.async_entities import (
    AsyncClient,
    AsyncClock,
    AsyncPublisher,
    AsyncService,
    AsyncSubscription,
    AsyncTimer,
    MsgT,
)
from actors.ros.rclpy.experimental.loop_dispatcher import LoopDispatcher
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.node_parts import parts_of
from actors.ros.rclpy.qos import qos_profile_services_default
from actors.ros.rclpy.service import Service
from actors.ros.rclpy.subscription import Subscription
from actors.ros.rclpy.timer import Timer, TimerInfo

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from actors.ros.rclpy.qos import QoSProfile
    from actors.ros.rclpy.subscription_content_filter_options import ContentFilterOptions


class AsyncNode(Node):
    """A node whose callbacks, `def` or `async def`, are tasks of the asyncio loop that enters it.

        async with AsyncNode("listener") as node:
            node.create_subscription(String, "chatter", callback, 10)
            await something()

    Those of one entity run one after another, those of different entities at the same time. An error of a
    callback cancels the body and leaves the `async with` block in an ExceptionGroup. Arguments are those of
    `Node`.
    """

    _callboard_classes = {  # noqa: RUF012 - a ClassVar of Node
        Subscription: AsyncSubscription,
        Client: AsyncClient,
        Service: AsyncService,
        Timer: AsyncTimer,
        ROSClock: AsyncClock,
    }

    def __init__(self, node_name: str, **options: Any) -> None:
        # The one attribute, as subclasses have their own: see `node_parts`.
        self._callboard_dispatcher: LoopDispatcher | None = None
        super().__init__(node_name, **options)

    async def __aenter__(self) -> Self:
        """Run callbacks from now on.

        Raises:
            RuntimeError: It has been destroyed, or runs already.
        """
        self._require_alive("enter")
        if self._callboard_dispatcher is not None:
            raise RuntimeError("The node runs already")
        parts = parts_of(self)
        dispatcher = LoopDispatcher(parts, await asyncio.TaskGroup().__aenter__(), self.destroy_node)
        self._callboard_dispatcher = dispatcher
        parts.active_executor = weakref.ref(dispatcher)
        # By signals, which end the context without destroying its nodes.
        self.context.track_executor(dispatcher)
        dispatcher.start()
        return self

    async def __aexit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        """Destroy the node, and wait for the end of its callbacks, which are cancelled."""
        self.destroy_node()
        if self._callboard_dispatcher is not None:
            await self._callboard_dispatcher.group.__aexit__(exc_type, exc_val, exc_tb)

    async def run(self) -> None:
        """Run callbacks until the node is destroyed, or the context ends.

        Raises:
            RuntimeError: The node runs already.
        """
        async with self:
            if self._callboard_dispatcher is not None:
                await self._callboard_dispatcher.ended.wait()

    def get_clock(self) -> AsyncClock:
        """Return the clock."""
        return cast("AsyncClock", self._clock)

    def destroy_node(self) -> None:
        """Take the node out of service, and cancel its callbacks. Idempotent."""
        if parts_of(self).destroyed:
            return
        self.get_clock().destroy()
        dispatcher = self._callboard_dispatcher
        if dispatcher is not None:
            dispatcher.stop()
        super().destroy_node()
        if dispatcher is not None:
            dispatcher.end()

    def _require_alive(self, what: str) -> None:
        if parts_of(self).destroyed:
            raise RuntimeError(f"Cannot {what}: the node {self._logger.name} has been destroyed")

    async def wait_for_node(  # type: ignore[override]  # as in rclpy
        self, fully_qualified_node_name: str, *, check_interval: float = 0.1
    ) -> None:
        """Wait until a node is in the graph, without a limit; the broker reports it at once.

        Args:
            fully_qualified_node_name: Its full name.
            check_interval: Not used.
        """
        del check_interval
        parts = parts_of(self)
        name = "/" + fully_qualified_node_name.lstrip("/")
        await asyncio.wrap_future(parts.thread.submit(lambda: parts.native.wait_for_node(name, None)))

    def create_publisher(  # type: ignore[override]  # without event callbacks, as in rclpy
        self, msg_type: type[MsgT], topic: str, qos_profile: QoSProfile | int
    ) -> AsyncPublisher[MsgT]:
        """Make a publisher.

        Args:
            msg_type: The message class.
            topic: The topic's name.
            qos_profile: A profile or a depth.

        Raises:
            RuntimeError: The node has been destroyed.
        """
        self._require_alive("create a publisher")
        made = super().create_publisher(msg_type, topic, qos_profile, publisher_class=AsyncPublisher)
        return cast("AsyncPublisher[MsgT]", made)

    def create_subscription(  # type: ignore[override]
        self,
        msg_type: type[MsgT],
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        raw: bool = False,
        concurrent: bool = False,
        content_filter_options: ContentFilterOptions | None = None,
    ) -> AsyncSubscription[MsgT]:
        """Make a subscription.

        Args:
            msg_type: The message class.
            topic: The topic's name.
            callback: `(msg)` or `(msg, info)`, `def` or `async def`.
            qos_profile: A profile or a depth.
            raw: Give messages as bytes.
            concurrent: Do not wait for the end of a callback before the next message.
            content_filter_options: As for `Node.create_subscription`.

        Raises:
            RuntimeError: The node has been destroyed.
        """
        self._require_alive("create a subscription")
        made = super().create_subscription(
            msg_type, topic, callback, qos_profile, raw=raw, content_filter_options=content_filter_options
        )
        subscription = cast("AsyncSubscription[MsgT]", made)
        subscription.concurrent = concurrent
        return subscription

    def create_service(  # type: ignore[override]
        self,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        concurrent: bool = False,
    ) -> AsyncService[Any, Any]:
        """Serve requests.

        Args:
            srv_type: The service class.
            srv_name: The service's name.
            callback: `(request, response)`, `def` or `async def`; returns the response.
            qos_profile: Its QoS.
            concurrent: Do not wait for the end of a callback before the next request.

        Raises:
            RuntimeError: The node has been destroyed.
        """
        self._require_alive("create a service")
        made = super().create_service(srv_type, srv_name, callback, qos_profile=qos_profile)
        service = cast("AsyncService[Any, Any]", made)
        service.concurrent = concurrent
        return service

    def create_client(  # type: ignore[override]
        self, srv_type: Any, srv_name: str, *, qos_profile: QoSProfile = qos_profile_services_default
    ) -> AsyncClient[Any, Any]:
        """Make a client of a service; RuntimeError: the node has been destroyed."""
        self._require_alive("create a client")
        made = super().create_client(srv_type, srv_name, qos_profile=qos_profile)
        return cast("AsyncClient[Any, Any]", made)

    def create_timer(  # type: ignore[override]
        self, timer_period_sec: float, callback: Callable[..., Any], autostart: bool = True
    ) -> AsyncTimer:
        """Call a function periodically.

        Args:
            timer_period_sec: The period in seconds.
            callback: `()`, or with one parameter, a TimerInfo; `def` or `async def`.
            autostart: Whether to tick before `reset` is called.

        Raises:
            RuntimeError: The node has been destroyed, or the callback has other parameters.
        """
        self._require_alive("create a timer")
        made = super().create_timer(timer_period_sec, _with_info(callback), autostart=autostart)
        return cast("AsyncTimer", made)


def _with_info(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Return a callback whose annotation says whether it gets a TimerInfo, as other nodes' have."""
    signature = inspect.signature(callback)
    for arguments in ((), (None,)):
        try:
            signature.bind(*arguments)
        except TypeError:
            continue

        def with_info(info: TimerInfo) -> Any:
            return callback(info)

        return with_info if arguments else callback
    raise RuntimeError("The callback of a timer must be callable without arguments, or with a TimerInfo")
