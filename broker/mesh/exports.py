"""What a broker tells the others of a mesh: its own endpoints, and the topics whose messages it wants."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from broker.access.rules import Action
from broker.mesh.messages import Change, Subscribe
from broker.routing.records import (
    ClientRecord,
    Endpoint,
    NodeRecord,
    PublisherRecord,
    ServiceRecord,
    SubscriptionRecord,
)
from proto.wire import frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.access.rules import Rights
    from broker.routing.router import Router
    from proto.queues.publisher_queue import PublisherQueue
    from proto.wire.frames import Frame


_COUNTERPARTS: Final = {
    Action.PUBLISH: Action.SUBSCRIBE,
    Action.SUBSCRIBE: Action.PUBLISH,
    Action.SERVE: Action.CALL,
    Action.CALL: Action.SERVE,
}


class MeshExports:
    """The endpoints of one graph that its own nodes have declared (`mirrored.ExportListener`).

    Args:
        emit: Takes each change.
        touch: Takes the topic of each subscription that comes or goes.
        peer: The id of the router's peer for the mesh.

    Attributes:
        version: The number of changes so far.
        rights: What other brokers may know; None for everything.
        import_rights: What their nodes may do here; likewise.
    """

    def __init__(self, emit: Callable[[Change], None], touch: Callable[[str], None], peer: int) -> None:
        self._emit = emit
        self._touch = touch
        self._peer = peer
        self.rights: Rights | None = None
        self.import_rights: Rights | None = None
        self.version = 0
        self._declarations: dict[int, Frame] = {}
        """By number, what the others know."""
        self._sorted: tuple[int, tuple[Frame, ...]] = (0, ())
        """For which version `declarations` has been called last, and its answer."""
        self._retired: set[int] = set()
        """Numbers of servers that the others know to be retired."""
        self._endpoints = Counter[int]()
        """By key of a node, how many of its endpoints the others know, retired ones included."""
        self._leaving: dict[int, Endpoint] = {}
        """By key, publishers that are gone and whose last messages are still to be sent, and nodes that are
        gone and have endpoints that the others know."""
        self._queues: dict[int, PublisherQueue] = {}
        """By key of such a publisher, what has its last messages."""

    def declarations(self) -> tuple[Frame, ...]:
        """Return all that is declared, nodes first: the same object until something changes."""
        version, declarations = self._sorted
        if version != self.version:
            ordered = sorted(self._declarations.values(), key=lambda frame: type(frame) is not frames.Node)
            declarations = tuple(ordered)
            self._sorted = self.version, declarations
        return declarations

    def has_type(self, type_hash: str) -> bool:
        """Return whether anything of a type is declared."""
        return any(getattr(each, "type_hash", None) == type_hash for each in self._declarations.values())

    def allows(self, endpoint: Endpoint) -> bool:
        """Return whether other brokers may know an endpoint, and what they have may be its counterpart."""
        action, name, node = endpoint.action, endpoint.name, endpoint.node
        if node is not None and node.private:
            return False
        counterpart = _COUNTERPARTS.get(action)
        if (
            counterpart is not None
            and self.import_rights is not None
            and not self.import_rights.may(counterpart, name)
        ):
            return False
        return self.rights is None or self.rights.may(action, name)

    def joined(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is new or back."""
        if isinstance(endpoint, SubscriptionRecord):
            self._touch(endpoint.name)
        # It is back before its last messages were sent. A node goes on as if nothing had been; others are
        # declared again, since their numbers have changed.
        if endpoint.key in self._leaving:
            if isinstance(endpoint, NodeRecord):
                del self._leaving[endpoint.key]
                return
            self._undeclare(endpoint)
        frame = self._declarations[endpoint.number] = declaration_of(endpoint)
        if endpoint.node is not None:
            self._endpoints[endpoint.node.key] += 1
        self._change(frame)

    def left(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is gone or suspended."""
        if endpoint.number not in self._declarations and endpoint.number not in self._retired:
            return
        # UNDECLARE would overtake the messages that still wait for other brokers, and they would ignore them
        # then. For the same reason a node waits for its endpoints.
        if isinstance(endpoint, PublisherRecord):
            route = endpoint.routes.get(self._peer)
            waits = route is not None
            if route is not None:
                self._queues[endpoint.key] = route.queue
        else:
            waits = endpoint.key in self._endpoints
        if waits:
            self._leaving[endpoint.key] = endpoint
        else:
            self._undeclare(endpoint)
        if isinstance(endpoint, SubscriptionRecord):
            self._touch(endpoint.name)

    def retired(self, server: ServiceRecord) -> None:
        """Note a server that gets no more requests."""
        if self._declarations.pop(server.number, None) is not None:
            self._retired.add(server.number)
            self._change(frames.Retire(server.number))

    def leaving(self, publisher: int) -> Endpoint | None:
        """Return a publisher that is gone and whose last messages are still to be sent, or None."""
        return self._leaving.get(publisher)

    def sent_all(self, publisher: int) -> None:
        """Note that the last message of a publisher that is gone has been sent, if it is gone."""
        endpoint = self._leaving.get(publisher)
        if endpoint is not None:
            self._undeclare(endpoint)

    def lost_all(self) -> None:
        """Note that the last messages of publishers that are gone may never be sent."""
        for endpoint in tuple(self._leaving.values()):
            if isinstance(endpoint, PublisherRecord):
                self._undeclare(endpoint)

    def forget_emptied(self) -> None:
        """Undeclare publishers that are gone, if their last messages were discarded with the readers."""
        for publisher in [key for key, queue in self._queues.items() if queue.empty]:
            self.sent_all(publisher)

    def _undeclare(self, endpoint: Endpoint) -> None:
        self._leaving.pop(endpoint.key, None)
        self._queues.pop(endpoint.key, None)
        self._declarations.pop(endpoint.number, None)
        self._retired.discard(endpoint.number)
        self._change(frames.Undeclare(endpoint.number))
        # The last endpoint of a node that has left takes the node along.
        node = endpoint.node
        if node is not None:
            self._endpoints[node.key] -= 1
            if not self._endpoints[node.key]:
                del self._endpoints[node.key]
                if node.key in self._leaving:
                    self._undeclare(node)

    def _change(self, frame: Frame) -> None:
        self.version += 1
        self._emit(Change(self.version, frame))


def declaration_of(endpoint: Endpoint) -> Frame:
    """Return the frame that declares an endpoint to other brokers, with numbers and the public gid."""
    number = endpoint.number
    if isinstance(endpoint, NodeRecord):
        labels, apart = endpoint.labels, endpoint.kept_apart
        return frames.Node(number, endpoint.name, endpoint.shared, labels, apart, endpoint.yields)
    assert endpoint.node is not None
    node, name = endpoint.node.number, endpoint.name
    type_name, type_hash = endpoint.type_name, endpoint.type_hash
    if isinstance(endpoint, PublisherRecord):
        return frames.Publisher(
            number,
            node,
            name,
            type_name,
            type_hash,
            endpoint.qos,
            endpoint.gid,
            endpoint.next_sequence,
            None,
            endpoint.live_sequence,
        )
    if isinstance(endpoint, SubscriptionRecord):
        return frames.Subscription(
            number,
            node,
            name,
            type_name or None,
            type_hash or None,
            endpoint.qos,
            endpoint.window_messages,
            endpoint.window_bytes,
            endpoint.stall_ms,
        )
    if isinstance(endpoint, ServiceRecord):
        return frames.Service(number, node, name, type_name, type_hash, None)
    assert isinstance(endpoint, ClientRecord)
    return frames.Client(number, node, name, type_name, type_hash)


class WantedTopics:
    """The topics to which this broker's nodes subscribe in one graph.

    A topic is wanted even if no other broker has a publisher on it: one may come, and send as soon as it
    learns of the subscription.

    Args:
        router: The graph's router.
        emit: Takes what to subscribe to.

    Attributes:
        touched: Topics for `update`.
    """

    def __init__(self, router: Router, emit: Callable[[Subscribe], None]) -> None:
        self._router = router
        self._emit = emit
        self.touched: set[str] = set()
        self._wanted: set[str] = set()

    def touch(self, topic: str) -> None:
        """Note that a subscription to a topic has come or gone."""
        self.touched.add(topic)

    def update(self) -> None:
        """Subscribe and unsubscribe as the noted topics need it."""
        for topic in self.touched:
            record = self._router.topics.by_name.get(topic)
            subscriptions = () if record is None else record.subscriptions.values()
            wanted = not all(each.mirrored or each.private for each in subscriptions)
            if wanted != (topic in self._wanted):
                (self._wanted.add if wanted else self._wanted.discard)(topic)
                self._emit(Subscribe(topic, wanted=wanted))
        self.touched.clear()
