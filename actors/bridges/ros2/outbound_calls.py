"""Calls of clients here to servers of ROS 2.

Each ends as calls do: with a response, or with an error that says why. A server of ROS 2 that gets more
requests than it keeps forgets some without an error, so the others wait here (`request_window.py`).
"""

from __future__ import annotations

import asyncio
import itertools
import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.request_window import RequestWindow
from actors.bridges.ros2 import services
from actors.bridges.ros2.errors import RosError, UnknownTypeError
from actors.callbacks.deadlines import Deadlines
from actors.errors import CallFailed, RemoteError, ServiceOverloaded, ServiceTimeout, ServiceUnavailable
from actors.interfaces.errors import InvalidMessageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.counters import Counts
    from actors.bridges.plan import Mirror
    from actors.bridges.ros2.endpoints import RosClient
    from actors.bridges.ros2.participant import RosNode
    from actors.bridges.ros2.topics import TopicFromRos
    from actors.bridges.ros2.types import ServiceTypes, Types
    from actors.endpoints.service.service import ServiceServer
    from actors.node.bare_node import BareNode

MATCH_LIMIT_SEC: Final = 10.0
"""How long calls wait until a client has found a server that ROS 2's graph shows, which takes some 0.1 s."""
WATCH_SEC: Final = 1.0
"""How often the servers are looked at while requests are in flight: a request ends with all servers that have
got it, and a server that is back must not wait for what a dead one has taken with it."""
_FRESH_SEC: Final = 0.25
"""How old may be what is known of the servers when a request is sent; to look takes some 0.1 ms."""

_FIRST_LOOK_SEC: Final = 0.005
_LAST_LOOK_SEC: Final = 0.25
"""The first and the longest delay between two looks whether a client has found its server."""
_MAX_SENT: Final = 4096
"""Requests without a response that are remembered; beyond it, those of callers who have given up are not."""


class OutboundCalls:
    """Carries the calls of clients here to servers of ROS 2.

    Args:
        node: The node of ROS 2 whose clients send the requests.
        types: The types.
        counts: Returns the counters of a service, by its name in ROS 2.
        topic: Returns a topic of ROS 2 that crosses, by name and type.
        request_hash: Returns the hash of the requests that the servers of a name take; "" if it is unknown.
    """

    def __init__(
        self,
        node: RosNode,
        types: Types,
        counts: Callable[[str], Counts],
        topic: Callable[[tuple[str, str]], TopicFromRos | None],
        request_hash: Callable[[str], str],
    ) -> None:
        self._node = node
        self._types = types
        self._counts = counts
        self._topic = topic
        self._request_hash = request_hash
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
            UnknownTypeError: One side does not have its type, or has another of this name.
        """
        types = self._types.service(mirror.type_name)
        server = self._servers.get(mirror.source)
        if server is None:
            known = self._types.known(mirror.type_name)
            difference = known.difference(self._request_hash(mirror.source))
            if difference:
                raise UnknownTypeError(f"'{mirror.source}' does not cross: {difference}")
            feedback = partial(self._topic, services.feedback_of(mirror.source, mirror.type_name))
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
        counts: Counts,
        feedback: Callable[[], TopicFromRos | None],
    ) -> None:
        self._node = node
        self._name = name
        self._types = types
        self._counts = counts
        self._feedback = feedback
        self._loop = asyncio.get_running_loop()
        self._is_long = name.endswith(services.RESULT)
        self._window: RequestWindow[bytes] = RequestWindow(is_long=self._is_long)
        self._keys = itertools.count()
        self._calls: dict[int, asyncio.Future[bytes]] = {}
        self._sent: dict[int, tuple[int, frozenset[bytes]]] = {}
        """The calls of requests in flight, and the servers that have got them, by ROS 2's numbers; also some
        whose callers have given up."""
        self._deadlines = Deadlines(self._expired)
        self._client: RosClient | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._looking_since: float | None = None
        """Since when calls wait for the client to find the server."""
        self._look_sec = _FIRST_LOOK_SEC
        self._there: frozenset[bytes] = frozenset()
        """The servers when they were last looked at."""
        self._looked = -math.inf
        self._watch: asyncio.TimerHandle | None = None
        self.mirrors: dict[Mirror, ServiceServer[bytes, bytes]] = {}

    def prepare(self) -> None:
        """Let the client of ROS 2 find the server."""
        if self._client is None:
            self._client = self._node.create_client(
                self._types.theirs, self._name, self._responded, qos=services.ros_qos(self._types)
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
        self._counts.received += 1
        if self._name.endswith(services.GOAL):
            await self._feedback_heard()
        key = next(self._keys)
        refusal = self._window.put(key, request, len(request))
        if refusal:
            self._counts.drop("overloaded")
            raise ServiceOverloaded(f"Service '{self._name}' in ROS 2: {refusal}")
        response: asyncio.Future[bytes] = self._loop.create_future()
        self._calls[key] = response
        if not self._is_long:  # the result of a goal: as long as there is a server, it may still come
            self._deadlines.add(key, self._loop.time() + services.CALL_LIMIT_SEC)
        self._send()
        try:
            return await response
        finally:
            self._deadlines.remove(key)
            # Otherwise its caller has given up, or died.
            if self._calls.pop(key, None) is not None:
                self._counts.drop("abandoned")
                self._window.abandon(key, self._loop.time())
                self._send()

    async def _feedback_heard(self) -> None:
        """Wait until the feedback is received: the server may publish some with the response.

        The client's subscription began before its call, but reaches ROS 2 by another way.
        """
        # DDS does not say when it connects two ends.
        end = self._loop.time() + services.FEEDBACK_SEC
        while self._loop.time() < end:
            topic = self._feedback()
            if topic is not None and topic.is_heard():
                return
            await asyncio.sleep(services.FEEDBACK_POLL_SEC)

    def close(self) -> None:
        """Forget the server; the handlers of all calls have been cancelled."""
        self._calls.clear()
        self._window.clear()
        self._deadlines.clear()
        for timer in (self._timer, self._watch):
            if timer is not None:
                timer.cancel()
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
        while (found := self._window.pop(now)) is not None:
            if now - self._looked > _FRESH_SEC or self._is_long:
                self._look_at_servers()
            self._send_one(*found)
        if self._window.waiting and (space := self._window.next_space()) < math.inf:
            self._wake(space)

    def _look_at_servers(self) -> None:
        before, self._there = self._there, self._node.servers(self._name)
        self._looked = self._loop.time()
        if before and self._there - before:
            # One that is back while ROS 2 still shows the dead one, which may have got all that is in flight.
            self._window.forget_in_flight()
        if self._watch is None:
            self._watch = self._loop.call_later(WATCH_SEC, self._watched)

    def _watched(self) -> None:
        """End the calls whose servers have left, though ROS 2 shows others of the name."""
        self._watch = None
        if not self._calls:
            return
        self._look_at_servers()
        for number, (key, servers) in tuple(self._sent.items()):
            if servers and servers.isdisjoint(self._there):
                del self._sent[number]
                self._window.responded(key)
                if key in self._calls:
                    self._counts.drop("unavailable")
                    self._fail(key, ServiceUnavailable("its server has left ROS 2"))
        self._send()

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
            self._sent = {each: sent for each, sent in self._sent.items() if sent[0] in self._calls}
        self._sent[number] = key, self._there

    def _not_sent(self, key: int, reason: str, error: CallFailed) -> None:
        self._window.responded(key)
        self._counts.drop(reason)
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
        key, _ = self._sent.pop(number, (None, None))
        if key is None or key not in self._calls:
            self._counts.drop("late")
        else:
            self._end(key, response)
        if key is not None:
            self._window.responded(key)
            self._send()

    def _end(self, key: int, response: object) -> None:
        try:
            body = self._types.response.from_object(response)
        except InvalidMessageError as error:
            self._counts.drop("invalid")
            self._fail(key, self._invalid(error))
            return
        waiting = self._calls.pop(key)
        if self._is_long:
            self._reply_after_feedback()
        if not waiting.done():
            self._counts.sent += 1
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
            self._counts.drop("unavailable")
            self._fail(key, ServiceUnavailable(f"Service '{self._name}' in ROS 2: {text}"))

    def _expired(self, key: int) -> None:
        self._counts.drop("timeout")
        self._window.abandon(key, self._loop.time())
        self._fail(key, ServiceTimeout(f"Service '{self._name}' in ROS 2: no response in time"))
        self._send()
