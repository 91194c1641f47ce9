"""One graph's part of the mesh, pure: other brokers as one peer of the router.

The router does with the peer what it does with any: it matches, counts, queues, grants credit and keeps latched
messages. Nothing that comes from one broker goes on to another: the engine (Zenoh) does that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.mesh.calls import MeshCalls
from broker.mesh.exports import MeshExports
from broker.mesh.imports import MeshImports
from broker.mesh.incoming import MeshReceiver
from broker.mesh.messages import Change, Message, Snapshot, Subscribe
from broker.mesh.outgoing import MeshSender

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.router import Router


class Mesh:
    """One graph's part of the mesh.

    Args:
        router: The graph's router.
        deliver: Takes what the router returns; a `report` must follow.

    Attributes:
        peer: The id of the router's peer for the mesh. What waits in its outbox goes to `sender`.
        sender: Takes frames from the router.
        receiver: Takes messages from other brokers.
    """

    def __init__(self, router: Router, deliver: Callable[[list[Delivery]], None]) -> None:
        self._router = router
        self._out: list[Message] = []
        self._touched: set[str] = set()
        """Topics whose subscriptions here or publishers elsewhere have changed."""
        self._wanted: set[str] = set()
        """The topics whose messages are wanted of other brokers."""
        self.peer, _ = router.connect(b"", b"", mesh=True)
        emit, touch, calls = self._out.append, self._touched.add, MeshCalls()
        self._exports = router.declarations.exports = MeshExports(emit, touch, self.peer)
        self._imports = MeshImports(router, self.peer, calls, deliver, touch)
        self.sender = MeshSender(router, self.peer, self._exports, self._imports, calls, emit)
        self.receiver = MeshReceiver(router, self.peer, self._imports, calls, deliver)

    def take(self) -> list[Message]:
        """Return the messages to send, in order."""
        out = self._out[:]
        self._out.clear()
        return out

    def snapshot(self) -> Snapshot:
        """Return this broker's endpoints, for brokers that have missed changes."""
        return self._exports.snapshot()

    def brokers(self) -> tuple[int, ...]:
        """Return the numbers of the brokers that are known."""
        return self._imports.brokers()

    def take_snapshot(self, broker: int, snapshot: Snapshot) -> None:
        """Replace what is known of a broker."""
        self._imports.take_snapshot(broker, snapshot)

    def take_change(self, broker: int, change: Change) -> bool:
        """Take a change; return False if the broker's snapshot is needed first."""
        return self._imports.take_change(broker, change)

    def remove_broker(self, broker: int) -> None:
        """Remove a broker that is gone, with its endpoints; calls to it fail."""
        self._imports.remove_broker(broker)

    def update_wanted(self) -> None:
        """Subscribe to the topics that publishers of other brokers and subscriptions of this one share."""
        for topic in self._touched:
            record = self._router.topics.by_name.get(topic)
            wanted = (
                record is not None
                and any(each.peer.mesh for each in record.publishers.values())
                and not all(each.peer.mesh for each in record.subscriptions.values())
            )
            if wanted != (topic in self._wanted):
                (self._wanted.add if wanted else self._wanted.discard)(topic)
                self._out.append(Subscribe(topic, wanted=wanted))
        self._touched.clear()
