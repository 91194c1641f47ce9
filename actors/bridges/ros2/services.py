"""Calls that cross: from clients here to servers of ROS 2, and from clients of ROS 2 to servers here.

A call of a client here ends as each call does: with a response, or with an error that says why. ROS 2 has no
such errors: what fails on the way to a server here is counted and logged, and the client of ROS 2 gets no
response, except from the services of an action.
"""

from __future__ import annotations

import asyncio
import itertools
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.bridges.request_window import RequestWindow
from actors.bridges.ros2.errors import RosError
from actors.callbacks.deadlines import Deadlines
from actors.errors import (
    CallFailed,
    NodeDestroyed,
    RemoteError,
    ServiceOverloaded,
    ServiceTimeout,
    ServiceUnavailable,
)
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import type_name
from actors.qos.profile import QoSProfile

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.plan import Mirror
    from actors.bridges.ros2.endpoints import RosClient, RosService
    from actors.bridges.ros2.participant import RosNode
    from actors.bridges.ros2.topics import TopicFromCallboard, TopicFromRos
    from actors.bridges.ros2.types import ServiceTypes, Types
    from actors.endpoints.client.client import Client
    from actors.endpoints.service.service import ServiceServer
    from actors.node.bare_node import BareNode

CALL_LIMIT_SEC: Final = 3600.0
"""How long a call may take, if its caller waits as long: what takes longer is an action. ROS 2 may lose a
request or a response, so that each call needs a limit."""
MATCH_LIMIT_SEC: Final = 10.0
"""How long calls wait until a client has found a server that ROS 2's graph shows, which takes some 0.1 s."""
MAX_PENDING: Final = 500
"""Requests of clients of ROS 2 that wait for one service here; one more is dropped, and counted. A service of
ROS 2 itself keeps 10."""
SERVICE_DEPTH: Final = 500
"""Requests and responses that have arrived in ROS 2 and wait for the loop; ROS 2's default of 10 loses others
without a word. From 100 on it costs 40 KiB more for each service or client."""
STALLED_SEC: Final = 1.0
"""How often the servers are counted while no request in flight gets a response: one that is back must not
wait for what a dead one has taken with it."""

_FIRST_LOOK_SEC: Final = 0.005
_LAST_LOOK_SEC: Final = 0.25
"""The first and the longest delay between two looks whether a client has found its server."""
_MAX_SENT: Final = 4096
"""Requests without a response that are remembered; beyond it, those of callers who have given up are not."""

FEEDBACK_SEC: Final = 0.5
"""How long a goal waits until its client's subscription to the feedback, which began before, has crossed."""
_POLL_SEC: Final = 0.02
"""Between two looks whether it has."""

_STANDARD: Final = ("rcl_interfaces/", "type_description_interfaces/", "lifecycle_msgs/")
"""What the types of services begin with that most nodes have and few call: they have ROS 2's default."""

_RESULT: Final = "/_action/get_result"
_GOAL: Final = "/_action/send_goal"
_CANCEL: Final = "/_action/cancel_goal"
_ABORTED: Final = 6
"""`action_msgs/msg/GoalStatus.STATUS_ABORTED`."""
_REJECTED: Final = 1
"""`action_msgs/srv/CancelGoal_Response.ERROR_REJECTED`."""


class CallCounts(Protocol):
    """Counts what happens to the calls of one service."""

    def received(self) -> None:
        """Count a request."""
        ...

    def sent(self) -> None:
        """Count a response."""
        ...

    def dropped(self, reason: str) -> None:
        """Count a request or a response that did not cross."""
        ...


def _feedback(name: str, type_name: str) -> tuple[str, str]:
    """Return name and type of the topic with the feedback of an action, by those of one of its services."""
    return f"{name.rpartition('/')[0]}/feedback", f"{type_name.rpartition('_')[0]}_FeedbackMessage"


def _qos(types: ServiceTypes) -> QoSProfile | None:
    """Return the QoS of a service or client in ROS 2; None for its default."""
    return None if type_name(types.ours).startswith(_STANDARD) else QoSProfile(depth=SERVICE_DEPTH)


class OutboundCalls:
    """Carries the calls of clients here to servers of ROS 2.

    Args:
        node: The node of ROS 2 whose clients send the requests.
        types: The types.
        counts: Returns the counters of a service, by its name in ROS 2.
        topic: Returns a topic of ROS 2 that crosses, by name and type.
    """

    def __init__(
        self,
        node: RosNode,
        types: Types,
        counts: Callable[[str], CallCounts],
        topic: Callable[[tuple[str, str]], TopicFromRos | None],
    ) -> None:
        self._node = node
        self._types = types
        self._counts = counts
        self._topic = topic
        self._servers: dict[str, _Server] = {}
        self._shown: dict[Mirror, ServiceServer[bytes, bytes]] = {}

    def show(self, mirror: Mirror, node: BareNode) -> ServiceServer[bytes, bytes]:
        """Show a server of ROS 2 to clients here.

        Args:
            mirror: The server.
            node: The node that has it here.

        Returns:
            The server here.

        Raises:
            UnknownTypeError: One side does not have its type.
        """
        types = self._types.service(mirror.type_name)
        server = self._servers.get(mirror.source)
        if server is None:
            feedback = partial(self._topic, _feedback(mirror.source, mirror.type_name))
            server = _Server(self._node, mirror.source, types, self._counts(mirror.source), feedback)
            self._servers[mirror.source] = server
        ours: Any = types.ours
        shown = node.create_service(ours, mirror.name, server.call, concurrent=True, raw=True)
        self._shown[mirror] = server.mirrors[mirror] = shown
        return shown

    def prepare(self, name: str) -> None:
        """Find a server in ROS 2 now, as a client has appeared here: the first call does it otherwise.

        Args:
            name: The full name of the service in ROS 2.
        """
        server = self._servers.get(name)
        if server is not None:
            server.prepare()

    def hide(self, mirror: Mirror) -> None:
        """Show a server no more; the calls of its clients end as ServiceUnavailable."""
        shown = self._shown.pop(mirror, None)
        if shown is None:
            return
        shown.destroy()
        server = self._servers[mirror.source]
        del server.mirrors[mirror]
        if not server.mirrors:
            del self._servers[mirror.source]
            server.close()

    def close(self) -> None:
        """Show no server any more."""
        for mirror in tuple(self._shown):
            self.hide(mirror)


class _Server:
    """The servers of ROS 2 of one name, and the calls for them.

    Args:
        node: As for `OutboundCalls`.
        name: Their name.
        types: Their type.
        counts: Counts the calls.
        feedback: For a service of an action, returns the topic of its feedback.

    Attributes:
        mirrors: The servers here that stand for them.
    """

    def __init__(
        self,
        node: RosNode,
        name: str,
        types: ServiceTypes,
        counts: CallCounts,
        feedback: Callable[[], TopicFromRos | None],
    ) -> None:
        self._node = node
        self._name = name
        self._types = types
        self._counts = counts
        self._feedback = feedback
        self._loop = asyncio.get_running_loop()
        self._is_long = name.endswith(_RESULT)
        self._window: RequestWindow[bytes] = RequestWindow(is_long=self._is_long)
        self._keys = itertools.count()
        self._calls: dict[int, asyncio.Future[bytes]] = {}
        self._sent: dict[int, int] = {}
        """The calls of requests in flight, by ROS 2's numbers; also of some whose callers have given up."""
        self._deadlines = Deadlines(self._expired)
        self._client: RosClient | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._looking_since: float | None = None
        """Since when calls wait for the client to find the server."""
        self._look_sec = _FIRST_LOOK_SEC
        self._progress = 0.0
        """When a request was sent, a response arrived, or the servers were counted."""
        self._counted = 0
        """How many there were."""
        self.mirrors: dict[Mirror, ServiceServer[bytes, bytes]] = {}

    def prepare(self) -> None:
        """Let the client of ROS 2 find the server."""
        if self._client is None:
            self._client = self._node.create_client(
                self._types.theirs, self._name, self._responded, qos=_qos(self._types)
            )

    async def call(self, request: bytes) -> bytes:
        """Return the response to a request.

        Args:
            request: It, as msgpack.

        Returns:
            The response, as msgpack.

        Raises:
            ServiceUnavailable: The server cannot be found, or ROS 2 refuses the request.
            ServiceOverloaded: Too many requests wait.
            ServiceTimeout: There is no response, and a limit for calls without a deadline has passed.
            RemoteError: The request has a value that ROS 2 cannot have, or the response is not valid.
        """
        self._counts.received()
        if self._name.endswith(_GOAL):
            await self._feedback_heard()
        key = next(self._keys)
        refusal = self._window.put(key, request, len(request))
        if refusal:
            self._counts.dropped("overloaded")
            raise ServiceOverloaded(f"Service '{self._name}' in ROS 2: {refusal}")
        response: asyncio.Future[bytes] = self._loop.create_future()
        self._calls[key] = response
        if not self._is_long:  # the result of a goal: as long as there is a server, it may still come
            self._deadlines.add(key, self._loop.time() + CALL_LIMIT_SEC)
        self._send()
        try:
            return await response
        finally:
            self._deadlines.remove(key)
            # Otherwise its caller has given up, or died.
            if self._calls.pop(key, None) is not None:
                self._counts.dropped("abandoned")
                self._window.abandon(key, self._loop.time())
                self._send()

    async def _feedback_heard(self) -> None:
        """Wait until the feedback is received: the server may publish some with the response.

        The client's subscription began before its call, but reaches ROS 2 by another way.
        """
        # DDS does not say when it connects two ends.
        end = self._loop.time() + FEEDBACK_SEC
        while self._loop.time() < end:
            topic = self._feedback()
            if topic is not None and topic.is_heard():
                return
            await asyncio.sleep(_POLL_SEC)

    def close(self) -> None:
        """Forget the server; the handlers of all calls have been cancelled."""
        self._calls.clear()
        self._window.clear()
        self._deadlines.clear()
        if self._timer is not None:
            self._timer.cancel()
        if self._client is not None:
            self._client.destroy()
            self._client = None

    def _send(self) -> None:
        """Send what waits, as far as the server takes it."""
        if not self._window.waiting:
            return
        now = self._loop.time()
        try:
            self.prepare()
        except RosError as error:
            self._fail_waiting(str(error))
            return
        if not self._is_found(now):
            return
        if now - self._progress >= STALLED_SEC:
            self._progress = now
            self._count_servers()
        while (found := self._window.pop(now)) is not None:
            self._progress = now
            self._send_one(*found)
        if self._window.waiting:
            self._wake(min(self._window.next_space(), now + STALLED_SEC))

    def _count_servers(self) -> None:
        """Send more requests if a server is back while ROS 2 still shows the dead one that has got others."""
        count = self._node.count_servers(self._name)
        if count > self._counted:
            self._window.forget_in_flight()
        self._counted = count

    def _send_one(self, key: int, request: bytes) -> None:
        assert self._client is not None
        try:
            number = self._client.send(self._types.request.to_object(request))
        except InvalidMessageError as error:
            self._not_sent(key, "invalid", self._invalid(error))
            return
        except RosError as error:
            self._not_sent(key, "refused", ServiceUnavailable(str(error)))
            return
        if len(self._sent) >= _MAX_SENT:
            self._sent = {number: each for number, each in self._sent.items() if each in self._calls}
        self._sent[number] = key

    def _not_sent(self, key: int, reason: str, error: CallFailed) -> None:
        self._window.responded(key)
        self._counts.dropped(reason)
        self._fail(key, error)

    def _invalid(self, error: InvalidMessageError) -> RemoteError:
        return RemoteError(type(error).__name__, str(error), self._name)

    def _is_found(self, now: float) -> bool:
        """Return whether the client has found a server; look again later if not.

        A request that is sent before is lost.
        """
        assert self._client is not None
        if self._client.is_ready():
            self._looking_since, self._look_sec = None, _FIRST_LOOK_SEC
            return True
        if self._looking_since is None:
            self._looking_since = now
        if now - self._looking_since > MATCH_LIMIT_SEC:
            self._looking_since = None
            self._fail_waiting("the bridge cannot connect to it")
            return False
        self._wake(now + self._look_sec)
        self._look_sec = min(2 * self._look_sec, _LAST_LOOK_SEC)
        return False

    def _wake(self, when: float) -> None:
        if self._timer is not None and self._timer.when() > when:
            self._timer.cancel()
            self._timer = None
        if self._timer is None:
            self._timer = self._loop.call_at(when, self._woken)

    def _woken(self) -> None:
        self._timer = None
        self._send()

    def _responded(self, number: int, response: object) -> None:
        key = self._sent.pop(number, None)
        if key is None or key not in self._calls:
            self._counts.dropped("late")
        else:
            self._end(key, response)
        if key is not None:
            self._progress = self._loop.time()
            self._window.responded(key)
            self._send()

    def _end(self, key: int, response: object) -> None:
        try:
            body = self._types.response.from_object(response)
        except InvalidMessageError as error:
            self._counts.dropped("invalid")
            self._fail(key, self._invalid(error))
            return
        waiting = self._calls.pop(key)
        if self._is_long:
            self._reply_after_feedback()
        if not waiting.done():
            self._counts.sent()
            waiting.set_result(body)

    def _reply_after_feedback(self) -> None:
        """Let the result of a goal follow the feedback that the server has published before."""
        topic = self._feedback()
        if topic is None:
            return
        topic.take_now()
        for mirror, shown in self.mirrors.items():
            publisher = topic.publisher_on(mirror.node)
            if publisher is not None:
                shown.reply_after(publisher)

    def _fail(self, key: int, error: CallFailed) -> None:
        waiting = self._calls.pop(key, None)
        if waiting is not None and not waiting.done():
            waiting.set_exception(error)

    def _fail_waiting(self, text: str) -> None:
        for key in self._window.pop_waiting():
            self._counts.dropped("unavailable")
            self._fail(key, ServiceUnavailable(f"Service '{self._name}' in ROS 2: {text}"))

    def _expired(self, key: int) -> None:
        self._counts.dropped("timeout")
        self._window.abandon(key, self._loop.time())
        self._fail(key, ServiceTimeout(f"Service '{self._name}' in ROS 2: no response in time"))
        self._send()


class InboundCalls:
    """Carries the calls of clients of ROS 2 to servers here.

    Args:
        node: The node here whose clients send the requests.
        types: The types.
        counts: Returns the counters of a service, by its name in ROS 2.
        warn: Logs, with a limit for each kind of line: the kind, and the line.
        topic: Returns a topic of callboard that crosses, by name and type.
    """

    def __init__(
        self,
        node: BareNode,
        types: Types,
        counts: Callable[[str], CallCounts],
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
        """Show a server here to clients of ROS 2.

        Args:
            mirror: The server.
            node: The node that has it in ROS 2.

        Raises:
            UnknownTypeError: One side does not have its type.
            RosError: ROS 2 refuses it.
        """
        types = self._types.service(mirror.type_name)
        service = self._services.get(mirror.name)
        if service is None:
            feedback = partial(self._topic, _feedback(mirror.source, mirror.type_name))
            service = _Service(
                self._node, mirror, types, self._counts(mirror.name), self._warn, feedback=feedback
            )
        service.show(mirror, node)
        self._services[mirror.name] = service

    def hide(self, mirror: Mirror) -> None:
        """Show a server no more; calls that came through it are cancelled."""
        service = self._services.get(mirror.name)
        if service is not None and service.hide(mirror):
            del self._services[mirror.name]

    def close(self) -> None:
        """Show no server any more."""
        for service in tuple(self._services.values()):
            for mirror in service.mirrors():
                self.hide(mirror)


class _Service:
    """The servers here of one name, as ROS 2 sees them.

    ROS 2 sends each request to all servers of a name. So only the first of them hands requests on: a call has
    one server here.
    """

    def __init__(
        self,
        node: BareNode,
        mirror: Mirror,
        types: ServiceTypes,
        counts: CallCounts,
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
        self._is_long = mirror.source.endswith(_RESULT)
        self._client: Client[bytes, bytes] | None = None
        self._after: object = None
        """The subscription to the feedback that results follow."""
        self._shown: dict[Mirror, RosService] = {}
        self._pending: dict[asyncio.Future[bytes] | asyncio.TimerHandle, tuple[Mirror, Any]] = {}
        """Calls, and goals that wait for their client's subscription to the feedback."""

    def mirrors(self) -> tuple[Mirror, ...]:
        """Return what is shown."""
        return tuple(self._shown)

    def show(self, mirror: Mirror, node: RosNode) -> None:
        """Show one of the servers; raise RosError if ROS 2 refuses it."""
        self._shown[mirror] = node.create_service(
            self._types.theirs, mirror.name, partial(self._requested, mirror), qos=_qos(self._types)
        )

    def hide(self, mirror: Mirror) -> bool:
        """Show one of the servers no more; return whether it was the last."""
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
        self._counts.received()
        if len(self._pending) >= MAX_PENDING:
            self._failed(mirror, header, "overloaded", f"{MAX_PENDING} requests wait already")
            return
        if self._source.endswith(_GOAL):
            self._call_when_heard(mirror, request, header, self._loop.time() + FEEDBACK_SEC)
        else:
            self._call(mirror, request, header)

    def _call_when_heard(self, mirror: Mirror, request: object, header: Any, end: float) -> None:
        """Hand a goal on when its feedback is received, of which the server may publish some at once.

        The client's subscription began before its call, but reaches callboard by another way.
        """
        topic = self._feedback()
        if (topic is not None and topic.subscription is not None) or self._loop.time() >= end:
            self._call(mirror, request, header)
            return

        def again() -> None:
            del self._pending[timer]
            self._call_when_heard(mirror, request, header, end)

        timer = self._loop.call_later(_POLL_SEC, again)
        self._pending[timer] = mirror, header

    def _call(self, mirror: Mirror, request: object, header: Any) -> None:
        if self._client is None:
            ours: Any = self._types.ours
            self._client = self._node.create_client(ours, self._source, raw=True)
        if self._is_long:
            self._receive_after_feedback(self._client)
        try:
            body = self._types.request.from_object(request)
            call = self._client.call_async(body, None if self._is_long else CALL_LIMIT_SEC)
        except (InvalidMessageError, NodeDestroyed) as error:
            self._failed(mirror, header, "invalid", str(error))
            return
        self._pending[call] = mirror, header
        call.add_done_callback(self._done)

    def _receive_after_feedback(self, client: Client[bytes, bytes]) -> None:
        """Let the results of goals follow the feedback, which has crossed then."""
        topic = self._feedback()
        subscription = None if topic is None else topic.subscription
        if subscription is not None and subscription is not self._after:
            self._after = subscription
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
            self._counts.dropped("refused")
            self._warn("a response that ROS 2 refuses", f"Service '{self._source}': {error}")
        else:
            self._counts.sent()

    def _failed(self, mirror: Mirror, header: Any, reason: str, text: str) -> None:
        """Count a call that has no response, and say so; the services of an action have one for it."""
        self._counts.dropped(reason)
        self._warn(
            f"a call from ROS 2 without a response: {reason}",
            f"Service '{self._source}': a call from ROS 2 has no response: {text}",
        )
        response = self._types.response.theirs()
        if self._source.endswith(_RESULT):
            response.status = _ABORTED
        elif self._source.endswith(_CANCEL):
            response.return_code = _REJECTED
        elif not self._source.endswith(_GOAL):  # whose response says that the goal is not accepted
            return
        self._respond(mirror, header, response)
