"""Endpoints that a bridge shows in ROS 2. When the loop calls them, they take what has arrived."""

from __future__ import annotations

import warnings
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from actors.bridges.ros2.arrivals import MAX_TAKES_PER_TURN
from actors.bridges.ros2.errors import RosError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.bridges.ros2.arrivals import Arrivals, Watch
    from actors.bridges.ros2.importing import Ros
    from actors.bridges.ros2.message_taker import RosMessageInfo

_Callback = TypeVar("_Callback", bound="Callable[..., None]")


@dataclass(frozen=True, kw_only=True)
class NodeContext:
    """What the endpoints of a node share.

    Attributes:
        ros: ROS 2.
        arrivals: What waits for messages.
        node: rclpy's node.
        endpoints: Those that have not been destroyed.
    """

    ros: Ros
    arrivals: Arrivals
    node: Any
    endpoints: set[Endpoint] = field(default_factory=set[Any])


class Endpoint:
    """An endpoint in ROS 2; nodes make them.

    Args:
        context: What the endpoints of the node share.
        endpoint: rclpy's.
    """

    kind: ClassVar[EntryKind]

    def __init__(self, context: NodeContext, endpoint: Any) -> None:
        self._context = context
        self._endpoint = endpoint
        self._handle = endpoint.handle
        context.endpoints.add(self)

    def destroy(self) -> None:
        """Destroy it. A second call does nothing."""
        if self in self._context.endpoints:
            self._context.endpoints.discard(self)
            getattr(self._context.node, f"destroy_{self.kind.name.lower()}")(self._endpoint)


class RosPublisher(Endpoint):
    """A publisher that a bridge shows in ROS 2."""

    kind = EntryKind.PUBLISHER

    def publish(self, cdr: bytes) -> None:
        """Publish a message.

        Args:
            cdr: The message in CDR, with its header.

        Raises:
            RosError: ROS 2 refuses it.
        """
        try:  # not by `ros_errors`, nor by rclpy's publisher: this is called for each message
            with self._handle:
                self._handle.publish_raw(cdr)
        except (RuntimeError, self._context.ros.implementation.InvalidHandle) as error:
            raise RosError(f"ROS 2 refuses a message: {error}") from error

    def subscription_count(self) -> int:
        """Return the number of matched subscriptions."""
        return int(self._endpoint.get_subscription_count())


class Listener(Endpoint, Generic[_Callback]):
    """An endpoint that takes what arrives, as long as it has a callback.

    Args:
        context: What the endpoints of the node share.
        endpoint: rclpy's.
        callback: As for `listen`.
    """

    def __init__(self, context: NodeContext, endpoint: Any, callback: _Callback | None) -> None:
        super().__init__(context, endpoint)
        self._callback: _Callback | None = None
        self._watch: Watch | None = None
        try:
            self.listen(callback)
        except RosError:
            super().destroy()
            raise

    def listen(self, callback: _Callback | None) -> None:
        """Start or stop taking what arrives.

        Args:
            callback: Called in the loop; None: the endpoint is only shown.

        Raises:
            RosError: There are too many open files.
        """
        if callback is not None and self._watch is None:
            self._watch = self._context.arrivals.watch(self._handle, self.kind, self._take)
        elif callback is None and self._watch is not None:
            self._watch.close()
            self._watch = None
        self._callback = callback

    def take_now(self) -> None:
        """Take what has arrived now, before the loop would do so; at most `MAX_TAKES_PER_TURN`."""
        self._take(0)

    def destroy(self) -> None:
        """Destroy it; nothing is taken any more. A second call does nothing."""
        self.listen(None)
        super().destroy()

    def _take(self, count: int) -> bool:
        with self._handle:
            for number in range(1, MAX_TAKES_PER_TURN + 1):
                if self._callback is None:
                    return False
                if (taken := self._take_one()) is None:
                    # A client gets the responses to other clients, too, and ROS 2 says nothing of them.
                    if number >= count:
                        return False
                    continue
                try:
                    self._callback(*taken)
                except Exception as error:  # noqa: BLE001 - one bad message must not stop the others
                    self._context.arrivals.on_error(error)
        return True

    def _take_one(self) -> tuple[Any, ...] | None:
        """Return the callback's arguments for the next thing that has arrived, or None."""
        raise NotImplementedError


class RosSubscription(Listener["Callable[[bytes, RosMessageInfo], None]"]):
    """A subscription that a bridge shows in ROS 2.

    Its callback gets each message in CDR, and what ROS 2 says about it.

    Args:
        context: What the endpoints of the node share.
        endpoint: rclpy's.
        callback: As for `listen`.
    """

    kind = EntryKind.SUBSCRIPTION

    def publisher_count(self) -> int:
        """Return the number of matched publishers."""
        with self._handle:
            return int(self._handle.get_publisher_count())

    def _take_one(self) -> tuple[bytes, RosMessageInfo] | None:
        return self._context.ros.taker.take(self._handle.pointer)


class RosClient(Listener["Callable[[int, Any], None]"]):
    """A client that a bridge shows in ROS 2.

    Its callback gets the sequence number of the request and the response.

    Args:
        context: What the endpoints of the node share.
        endpoint: rclpy's.
        callback: As for `listen`.
        service_class: rclpy's class of the service.
    """

    kind = EntryKind.CLIENT

    def __init__(
        self,
        context: NodeContext,
        endpoint: Any,
        callback: Callable[[int, Any], None] | None,
        service_class: type[Any],
    ) -> None:
        self._class = service_class.Response
        super().__init__(context, endpoint, callback)

    def is_ready(self) -> bool:
        """Return whether ROS 2 shows a server, which may be dead for up to its lease."""
        with self._handle:
            return bool(self._handle.service_server_is_available())

    def send(self, request: Any) -> int:
        """Send a request.

        Args:
            request: rclpy's message.

        Returns:
            The sequence number, which the response carries.

        Raises:
            RosError: ROS 2 refuses it.
        """
        with ros_errors(self._context.ros, "ROS 2 refuses a request"), self._handle:
            return int(self._handle.send_request(request))

    def _take_one(self) -> tuple[int, Any] | None:
        header, response = self._handle.take_response(self._class)
        return None if header is None else (header.request_id.sequence_number, response)


class RosService(Listener["Callable[[Any, Any], None]"]):
    """A service that a bridge shows in ROS 2.

    Its callback gets the request and its header, which `respond` needs.

    Args:
        context: What the endpoints of the node share.
        endpoint: rclpy's.
        callback: As for `listen`.
        service_class: rclpy's class of the service.
    """

    kind = EntryKind.SERVICE

    def __init__(
        self,
        context: NodeContext,
        endpoint: Any,
        callback: Callable[[Any, Any], None] | None,
        service_class: type[Any],
    ) -> None:
        self._class = service_class.Request
        super().__init__(context, endpoint, callback)

    def respond(self, response: Any, header: Any) -> None:
        """Send the response to a request, at any time.

        Nothing happens if ROS 2 knows that the client has gone. As long as it has not found out how to reach
        the client, Fast DDS waits for up to 0.1 s.

        Args:
            response: rclpy's message.
            header: That of the request.

        Raises:
            RosError: ROS 2 refuses it, or does not reach the client.
        """
        with (
            ros_errors(self._context.ros, "ROS 2 refuses a response"),
            warnings.catch_warnings(record=True) as caught,
            self._handle,
        ):
            warnings.simplefilter("always")
            self._handle.service_send_response(response, header.request_id)
        if caught:  # that the client was not reached; rclpy has no exception for it
            raise RosError(f"ROS 2 loses a response: {caught[0].message}")

    def _take_one(self) -> tuple[Any, Any] | None:
        request, header = self._handle.service_take_request(self._class)
        return None if header is None else (request, header)


@contextmanager
def ros_errors(ros: Ros, text: str) -> Generator[None]:
    """Raise RosError for what rclpy raises about its arguments and what its C library refuses.

    Args:
        ros: ROS 2.
        text: What the error's text begins with.
    """
    # RCLError and its like are RuntimeErrors; classes that are no messages raise AttributeError or TypeError;
    # values out of a field's range also SystemError and OverflowError.
    names = ros.rclpy.exceptions.NameValidationException
    errors = (ValueError, RuntimeError, AttributeError, TypeError, SystemError, OverflowError)
    try:
        yield
    except (*errors, names, ros.implementation.InvalidHandle) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]  # the name with a caret may follow
        raise RosError(f"{text}: {reason.rstrip(':')}") from error
