"""What brokers ask each other: definitions of types (DESCRIBE), and for a sign of life (PING).

A definition that no node of this broker has declared is requested when a node asks, and not kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from broker.routing.deliveries import Send
from proto.wire import frames
from proto.wire.type_hash import hash_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from broker.mesh.exports import MeshExports
    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router
    from proto.wire.frames import Frame

MAX_ANSWER_HEARTBEATS: Final = 2
"""Heartbeats of this broker, one a second, for which a request waits for its answer."""


@dataclass(slots=True)
class _Request:
    """A definition that nodes of this broker wait for.

    Attributes:
        untried: Brokers to ask next.
        broker: The one that has been asked.
        heartbeats: For how many heartbeats it has not answered.
        peers: The peers of the router that have asked, in order.
    """

    untried: list[int]
    broker: int = 0
    heartbeats: int = 0
    peers: dict[int, None] = field(default_factory=dict[int, None])


def _ignore(_broker: int, _token: int) -> None:
    """Ignore the answer to a PING."""


class MeshQueries:
    """The queries of one graph, and the answers to those of other brokers.

    Args:
        router: The graph's router.
        exports: What other brokers may see of it.
        direct: Sends a frame to a broker.
        deliver: Takes the answers to this broker's nodes.

    Attributes:
        handlers: What handles a broker's frame, by its type.
        ponged: Called with a broker and the token of its answer to PING.
    """

    def __init__(
        self,
        router: Router,
        exports: MeshExports,
        direct: Callable[[int, Frame], None],
        deliver: Callable[[list[Delivery]], None],
    ) -> None:
        self._router = router
        self._exports = exports
        self._direct = direct
        self._deliver = deliver
        self._requests: dict[str, _Request] = {}
        self.ponged: Callable[[int, int], None] = _ignore
        self.handlers: Mapping[type[Any], Callable[[int, Any], None]] = {
            frames.Describe: self._describe,
            frames.Definition: self._accept_definition,
            frames.Ping: lambda broker, frame: direct(broker, frames.Pong(frame.token)),
            frames.Pong: lambda broker, frame: self.ponged(broker, frame.token),
        }

    def ping(self, brokers: Iterable[int], token: int) -> None:
        """Send PING to brokers."""
        for broker in brokers:
            self._direct(broker, frames.Ping(token))

    def request(self, peer: int, type_hash: str) -> bool:
        """Request a definition for a peer of the router; return False if no other broker has the type."""
        request = self._requests.get(type_hash)
        if request is None:
            untried = self._router.graph.other_brokers_of_type(type_hash)
            if not untried:
                return False
            request = self._requests[type_hash] = _Request(untried)
            self._ask_next(type_hash, request)
        request.peers[peer] = None
        return True

    def _describe(self, broker: int, frame: frames.Describe) -> None:
        """Answer another broker's request."""
        definition = self._router.declarations.definitions.get(frame.type_hash)
        # Only definitions of types that other brokers may know of: the type of a private endpoint stays
        # private.
        if definition is not None and not self._exports.has_type(frame.type_hash):
            definition = None
        self._direct(broker, frames.Definition(frame.type_hash, definition))

    def _accept_definition(self, broker: int, frame: frames.Definition) -> None:
        """Take another broker's answer; one that has not been asked is ignored."""
        request = self._requests.get(frame.type_hash)
        if request is None or request.broker != broker:
            return
        # The hash shows whether a definition is right, from any broker; a wrong one costs one more query.
        if frame.definition is not None and hash_of(frame.definition) == frame.type_hash:
            self._answer(frame, request)
        else:
            self._ask_next(frame.type_hash, request)

    def expire(self) -> None:
        """Count a heartbeat; ask the next broker where one has not answered in time."""
        for type_hash, request in tuple(self._requests.items()):
            request.heartbeats += 1
            if request.heartbeats > MAX_ANSWER_HEARTBEATS:
                self._ask_next(type_hash, request)

    def remove_broker(self, broker: int) -> None:
        """Do not wait for a broker that is gone."""
        for type_hash, request in tuple(self._requests.items()):
            request.untried = [each for each in request.untried if each != broker]
            if request.broker == broker:
                self._ask_next(type_hash, request)

    def _ask_next(self, type_hash: str, request: _Request) -> None:
        if not request.untried:
            self._answer(frames.Definition(type_hash, None), request)
            return
        request.broker, request.heartbeats = request.untried.pop(), 0
        self._direct(request.broker, frames.Describe(type_hash))

    def _answer(self, frame: frames.Definition, request: _Request) -> None:
        del self._requests[frame.type_hash]
        self._deliver([Send(peer, frame) for peer in request.peers])
