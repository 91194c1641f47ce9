"""Calls of ROS 2's clients to servers of callboard.

ROS 2 has no errors for calls. A call that fails is counted and logged, and its client gets no response; only
the services of an action have responses which say that the goal is rejected or over.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.ros2 import services
from actors.bridges.ros2.errors import RosError
from actors.errors import CallFailed, NodeDestroyed, ServiceTimeout, ServiceUnavailable
from actors.interfaces.errors import InvalidMessageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.counters import Counts
    from actors.bridges.plan import Mirror
    from actors.bridges.ros2.endpoints import RosService
    from actors.bridges.ros2.participant import RosNode
    from actors.bridges.ros2.topics import TopicFromCallboard
    from actors.bridges.ros2.types import ServiceTypes, Types
    from actors.endpoints.client.client import Client
    from actors.node.bare_node import BareNode

MAX_PENDING: Final = 500
"""Requests from ROS 2 that wait for one service of callboard; one more is dropped and counted. A service of
ROS 2 itself keeps 10."""

_ABORTED: Final = 6
"""`action_msgs/msg/GoalStatus.STATUS_ABORTED`."""
_REJECTED: Final = 1
"""`action_msgs/srv/CancelGoal_Response.ERROR_REJECTED`."""


class InboundCalls:
    """Passes calls of ROS 2's clients on to servers of callboard.

    Args:
        node: The node in callboard whose clients send the requests.
        types: Finds the types of both sides.
        counts: Returns the counts of a service, by its name in ROS 2.
        warn: Logs a warning, at a limited rate for each kind; gets the kind and the line.
        topic: Returns a topic that crosses from callboard, by its name and type; None if there is none.
    """

    def __init__(
        self,
        node: BareNode,
        types: Types,
        counts: Callable[[str], Counts],
        warn: Callable[[str, str], object],
        topic: Callable[[tuple[str, str]], TopicFromCallboard | None],
    ) -> None:
        self._node = node
        self._types = types
        self._counts = counts
        self._warn = warn
        self._topic = topic
        self._services: dict[str, _Service] = {}

    def show(self, mirror: Mirror, node: RosNode) -> None:
        """Show a server of callboard in ROS 2.

        Args:
            mirror: The mirror of the server.
            node: The mirror node in ROS 2.

        Raises:
            UnknownTypeError: One side does not have its type.
            RosError: ROS 2 refuses it.
        """
        types = self._types.service(mirror.type_name)
        service = self._services.get(mirror.name)
        if service is None:
            feedback = partial(self._topic, services.feedback_of(mirror.source, mirror.type_name))
            service = _Service(
                self._node, mirror, types, self._counts(mirror.name), self._warn, feedback=feedback
            )
        service.show(mirror, node)
        self._services[mirror.name] = service

    def hide(self, mirror: Mirror) -> None:
        """Hide a server; calls that came through it are cancelled."""
        service = self._services.get(mirror.name)
        if service is not None and service.hide(mirror):
            del self._services[mirror.name]

    def close(self) -> None:
        """Hide all servers."""
        for service in tuple(self._services.values()):
            for mirror in service.mirrors():
                self.hide(mirror)


class _Service:
    """The servers of one name in callboard, as ROS 2 sees them.

    ROS 2 sends each request to all servers of a name. Only the first of them passes requests on, so that a
    call reaches one server of callboard.
    """

    def __init__(
        self,
        node: BareNode,
        mirror: Mirror,
        types: ServiceTypes,
        counts: Counts,
        warn: Callable[[str, str], object],
        *,
        feedback: Callable[[], TopicFromCallboard | None],
    ) -> None:
        self._node = node
        self._source = mirror.source
        self._types = types
        self._counts = counts
        self._warn = warn
        self._feedback = feedback
        self._loop = asyncio.get_running_loop()
        self._is_long = mirror.source.endswith(services.RESULT)
        self._client: Client[bytes, bytes] | None = None
        self._followed: object = None
        """The feedback subscription after whose messages the client receives results."""
        self._shown: dict[Mirror, RosService] = {}
        self._pending: dict[asyncio.Future[bytes] | asyncio.TimerHandle, tuple[Mirror, Any]] = {}
        """Calls that run, and timers of goals that wait for the feedback subscription of their client; each
        with the mirror and the header of the request."""

    def mirrors(self) -> tuple[Mirror, ...]:
        """Return the mirrors that are shown."""
        return tuple(self._shown)

    def show(self, mirror: Mirror, node: RosNode) -> None:
        """Show a further server; raise RosError if ROS 2 refuses it."""
        self._shown[mirror] = node.create_service(
            self._types.theirs,
            mirror.name,
            partial(self._requested, mirror),
            qos=services.SERVICE_QOS,
        )

    def hide(self, mirror: Mirror) -> bool:
        """Hide one of the servers; return whether it was the last."""
        shown = self._shown.get(mirror)
        if shown is not None:
            for call in [each for each, (own, _) in self._pending.items() if own == mirror]:
                call.cancel()
                self._failed(*self._pending.pop(call), "unavailable", "the server is gone")
            del self._shown[mirror]
            shown.destroy()
        if self._shown:
            return False
        if self._client is not None:
            self._client.destroy()
            self._client = None
        return True

    def _requested(self, mirror: Mirror, request: object, header: Any) -> None:
        if mirror is not next(iter(self._shown), None):
            return
        self._counts.received += 1
        if len(self._pending) >= MAX_PENDING:
            self._failed(mirror, header, "overloaded", f"{MAX_PENDING} requests wait already")
            return
        if self._source.endswith(services.GOAL):
            self._call_when_feedback_is_received(
                mirror, request, header, self._loop.time() + services.FEEDBACK_SEC
            )
        else:
            self._call(mirror, request, header)

    def _call_when_feedback_is_received(
        self, mirror: Mirror, request: object, header: Any, end: float
    ) -> None:
        """Pass a goal on when its feedback would be received: the server may publish some at once.

        The client subscribed before its call, but the subscription crosses the bridge by another way.
        """
        topic = self._feedback()
        if (topic is not None and topic.subscription is not None) or self._loop.time() >= end:
            self._call(mirror, request, header)
            return

        def again() -> None:
            del self._pending[timer]
            self._call_when_feedback_is_received(mirror, request, header, end)

        timer = self._loop.call_later(services.FEEDBACK_POLL_SEC, again)
        self._pending[timer] = mirror, header

    def _call(self, mirror: Mirror, request: object, header: Any) -> None:
        if self._client is None:
            ours: Any = self._types.ours
            self._client = self._node.create_client(ours, self._source, raw=True)
        if self._is_long:
            self._receive_after_feedback(self._client)
        try:
            body = self._types.request.from_object(request)
            call = self._client.call_async(body, None if self._is_long else services.CALL_LIMIT_SEC)
        except (InvalidMessageError, NodeDestroyed) as error:
            self._failed(mirror, header, "invalid", str(error))
            return
        self._pending[call] = mirror, header
        call.add_done_callback(self._done)

    def _receive_after_feedback(self, client: Client[bytes, bytes]) -> None:
        """Let the client receive results of goals after their feedback, so that both cross in this order."""
        topic = self._feedback()
        subscription = None if topic is None else topic.subscription
        if subscription is not None and subscription is not self._followed:
            self._followed = subscription
            client.receive_after(subscription)

    def _done(self, call: asyncio.Future[bytes]) -> None:
        found = self._pending.pop(call, None)
        if found is None:  # hidden
            return
        mirror, header = found
        try:
            response = self._types.response.to_object(call.result())
        except InvalidMessageError as error:
            self._failed(mirror, header, "invalid", str(error))
        except ServiceTimeout as error:
            self._failed(mirror, header, "timeout", str(error))
        except ServiceUnavailable as error:
            self._failed(mirror, header, "unavailable", str(error))
        except (CallFailed, NodeDestroyed) as error:
            self._failed(mirror, header, "failed", str(error))
        else:
            self._respond(mirror, header, response)

    def _respond(self, mirror: Mirror, header: Any, response: object) -> None:
        try:
            self._shown[mirror].respond(response, header)
        except RosError as error:
            self._counts.drop("refused")
            self._warn("a response that ROS 2 refuses", f"Service '{self._source}': {error}")
        else:
            self._counts.sent += 1

    def _failed(self, mirror: Mirror, header: Any, reason: str, text: str) -> None:
        """Count and log a call that failed; for services of an action, send the response that says so."""
        self._counts.drop(reason)
        self._warn(
            f"a call from ROS 2 without a response: {reason}",
            f"Service '{self._source}': a call from ROS 2 has no response: {text}",
        )
        response = self._types.response.theirs()
        if self._source.endswith(services.RESULT):
            response.status = _ABORTED
        elif self._source.endswith(services.CANCEL):
            response.return_code = _REJECTED
        elif not self._source.endswith(services.GOAL):  # an empty response rejects the goal
            return
        self._respond(mirror, header, response)
