"""Calls of callboard's clients to servers of ROS 2.

Each ends as calls do: with a response, or with an error that says why. A server of ROS 2 that gets more
requests than it keeps forgets some without an error, so only a few are sent and the others wait here
(`request_window.py`).
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
"""How long calls wait until DDS has matched the client with a server that ROS 2's graph shows. That takes
some 0.1 s."""
WATCH_SEC: Final = 1.0
"""How often the list of servers is read while requests are in flight. A request fails when all servers that
got it have left, and a server that is back must not wait for responses of the one before."""
_FRESH_SEC: Final = 0.25
"""The greatest age of the list of servers when a request is sent; reading it takes some 0.1 ms."""

_FIRST_POLL_SEC: Final = 0.005
_LAST_POLL_SEC: Final = 0.25
"""The first and the longest delay between two checks whether DDS has matched the client."""
_MAX_SENT: Final = 4096
"""Requests without a response that are remembered. Beyond it, those whose callers have given up are
forgotten: their late responses are counted all the same."""


class OutboundCalls:
    """Passes calls of callboard's clients on to servers of ROS 2.

    Args:
        node: The node in ROS 2 whose clients send the requests.
        types: Finds the types of both sides.
        counts: Returns the counts of a service, by its name in ROS 2.
        topic: Returns a topic that crosses from ROS 2, by its name and type; None if there is none.
        request_hash: Returns the hash of the request type of a service's servers; "" if it is unknown.
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
        """Show a server of ROS 2 in callboard.

        Args:
            mirror: The mirror of the server.
            node: The mirror node in callboard.

        Returns:
            The server in callboard.

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
        """Create the client for a server of ROS 2 now, as callboard has a client: its first call waits less.

        Args:
            name: The full name of the service in ROS 2.
        """
        server = self._servers.get(name)
        if server is not None:
            server.prepare()

    def hide(self, mirror: Mirror) -> None:
        """Hide a server; its calls end with ServiceUnavailable."""
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
        """Hide all servers."""
        for mirror in tuple(self._shown):
            self.hide(mirror)


class _Server:
    """The servers of one name in ROS 2, and the calls to them.

    Args:
        node: As for `OutboundCalls`.
        name: The full name of the service.
        types: Its type.
        counts: Counts its calls.
        feedback: Returns the feedback topic of the action that the service belongs to; None if there is none.

    Attributes:
        mirrors: The servers in callboard that stand for them.
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
        """By ROS 2's sequence number, the keys of sent requests and the gids of the servers that got them;
        also of some requests whose callers have given up."""
        self._deadlines = Deadlines(self._expired)
        self._client: RosClient | None = None
        self._send_timer: asyncio.TimerHandle | None = None
        self._unmatched_since: float | None = None
        """When calls began to wait for DDS to match the client."""
        self._poll_sec = _FIRST_POLL_SEC
        self._server_gids: frozenset[bytes] = frozenset()
        """The servers when they were read last; dead ones are among them until their lease ends."""
        self._servers_read_at = -math.inf
        self._check_timer: asyncio.TimerHandle | None = None
        self.mirrors: dict[Mirror, ServiceServer[bytes, bytes]] = {}

    def prepare(self) -> None:
        """Create the client in ROS 2, so that DDS matches it."""
        if self._client is None:
            self._client = self._node.create_client(
                self._types.theirs, self._name, self._responded, qos=services.SERVICE_QOS
            )

    async def call(self, request: bytes) -> bytes:
        """Return the response to a request.

        Args:
            request: The request as msgpack.

        Returns:
            The response as msgpack.

        Raises:
            ServiceUnavailable: The server cannot be found, or ROS 2 refuses the request.
            ServiceOverloaded: Too many requests wait.
            ServiceTimeout: There was no response within CALL_LIMIT_SEC; deadlines of callers are shorter.
            RemoteError: The request has a value that ROS 2 does not allow, or the response is invalid.
        """
        self._counts.received += 1
        if self._name.endswith(services.GOAL):
            await self._wait_for_feedback()
        key = next(self._keys)
        refusal = self._window.put(key, request, len(request))
        if refusal:
            self._counts.drop("overloaded")
            raise ServiceOverloaded(f"Service '{self._name}' in ROS 2: {refusal}")
        response: asyncio.Future[bytes] = self._loop.create_future()
        self._calls[key] = response
        if not self._is_long:  # the result of a goal may take as long as the server lives
            self._deadlines.add(key, self._loop.time() + services.CALL_LIMIT_SEC)
        self._send()
        try:
            return await response
        finally:
            self._deadlines.remove(key)
            # If it is still there, it has no response: the caller has given up or died.
            if self._calls.pop(key, None) is not None:
                self._counts.drop("abandoned")
                self._window.abandon(key, self._loop.time())
                self._send()

    async def _wait_for_feedback(self) -> None:
        """Wait until feedback of the goal would be received: the server may publish some at once.

        The client subscribed before its call, but the subscription crosses the bridge by another way.
        """
        # By polling: DDS does not tell when it has matched a subscription.
        end = self._loop.time() + services.FEEDBACK_SEC
        while self._loop.time() < end:
            topic = self._feedback()
            if topic is not None and topic.is_connected():
                return
            await asyncio.sleep(services.FEEDBACK_POLL_SEC)

    def close(self) -> None:
        """Destroy the client; the handlers of all calls have been cancelled before."""
        self._calls.clear()
        self._window.clear()
        self._deadlines.clear()
        for timer in (self._send_timer, self._check_timer):
            if timer is not None:
                timer.cancel()
        if self._client is not None:
            self._client.destroy()
            self._client = None

    def _send(self) -> None:
        """Send requests that wait, as many as the window admits."""
        if not self._window.waiting:
            return
        now = self._loop.time()
        try:
            self.prepare()
        except RosError as error:
            self._fail_waiting(str(error))
            return
        if not self._is_matched(now):
            return
        while (found := self._window.pop(now)) is not None:
            if now - self._servers_read_at > _FRESH_SEC or self._is_long:
                self._read_servers()
            self._send_one(*found)
        if self._window.waiting and (space := self._window.next_space()) < math.inf:
            self._send_later(space)

    def _read_servers(self) -> None:
        before, self._server_gids = self._server_gids, self._node.servers(self._name)
        self._servers_read_at = self._loop.time()
        if before and self._server_gids - before:
            # A server is back while ROS 2 still shows the dead one, which may have got all that is in flight.
            self._window.forget_in_flight()
        if self._check_timer is None:
            self._check_timer = self._loop.call_later(WATCH_SEC, self._check_servers)

    def _check_servers(self) -> None:
        """Fail the calls whose servers have left, though ROS 2 may show others of the name."""
        self._check_timer = None
        if not self._calls:
            return
        self._read_servers()
        for number, (key, servers) in tuple(self._sent.items()):
            if servers and servers.isdisjoint(self._server_gids):
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
        self._sent[number] = key, self._server_gids

    def _not_sent(self, key: int, reason: str, error: CallFailed) -> None:
        self._window.responded(key)
        self._counts.drop(reason)
        self._fail(key, error)

    def _invalid(self, error: InvalidMessageError) -> RemoteError:
        return RemoteError(type(error).__name__, str(error), self._name)

    def _is_matched(self, now: float) -> bool:
        """Return whether DDS has matched the client with a server; if not, check again later.

        A request that is sent before would be lost.
        """
        assert self._client is not None
        if self._client.is_ready():
            self._unmatched_since, self._poll_sec = None, _FIRST_POLL_SEC
            return True
        if self._unmatched_since is None:
            self._unmatched_since = now
        if now - self._unmatched_since > MATCH_LIMIT_SEC:
            self._unmatched_since = None
            self._fail_waiting("the bridge cannot connect to it")
            return False
        self._send_later(now + self._poll_sec)
        self._poll_sec = min(2 * self._poll_sec, _LAST_POLL_SEC)
        return False

    def _send_later(self, when: float) -> None:
        if self._send_timer is not None and self._send_timer.when() > when:
            self._send_timer.cancel()
            self._send_timer = None
        if self._send_timer is None:
            self._send_timer = self._loop.call_at(when, self._send_waiting)

    def _send_waiting(self) -> None:
        self._send_timer = None
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
        """Let the result of a goal reach its client after the feedback that the server published before."""
        topic = self._feedback()
        if topic is None:
            return
        topic.receive_now()
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
