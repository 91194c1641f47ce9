"""The endpoints of other brokers, declared to this broker's router as those of one peer."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple

from broker.mirrored import Mirror
from proto import frames
from proto.errors import InvalidNameError, ProtocolError
from proto.qos import Refusal

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.mesh.calls import MeshCalls
    from broker.mesh.messages import Change, Snapshot
    from broker.router import Router
    from proto.frames import Frame


class Remote(NamedTuple):
    """An endpoint of another broker."""

    broker: int
    number: int

    @property
    def key(self) -> int:
        """Its key in the mesh."""
        return self.broker << 32 | self.number


@dataclass(slots=True)
class _Broker:
    """Another broker: the last of its changes that is known, and its endpoints, each with its id here."""

    version: int
    ids: dict[int, int] = field(default_factory=dict[int, int])


class MeshImports:
    """The endpoints of all other brokers in one graph.

    Args:
        router: The graph's router.
        mesh: The id of the router's peer for the mesh.
        calls: The calls to other brokers.
        deliver: Takes what the router returns.

    Attributes:
        refused: Declarations that this broker's router does not take.
    """

    def __init__(
        self,
        router: Router,
        mesh: int,
        calls: MeshCalls,
        deliver: Callable[[list[Delivery]], None],
    ) -> None:
        self._router = router
        self._mesh = mesh
        self._calls = calls
        self._deliver = deliver
        self._ids = count(1)
        self._brokers: dict[int, _Broker] = {}
        self._remotes: dict[int, Remote] = {}
        self.refused = 0

    def version(self, broker: int) -> int:
        """Return how many changes of a broker are known."""
        known = self._brokers.get(broker)
        return 0 if known is None else known.version

    def id_of(self, broker: int, number: int) -> int | None:
        """Return the id of another broker's endpoint at the router; None if it is unknown."""
        known = self._brokers.get(broker)
        return None if known is None else known.ids.get(number)

    def remote(self, endpoint: int) -> Remote | None:
        """Return which endpoint has an id at the router; None if it has gone."""
        return self._remotes.get(endpoint)

    def take_snapshot(self, broker: int, snapshot: Snapshot) -> None:
        """Replace what is known of a broker."""
        known = self._brokers.get(broker)
        if known is None:
            known = self._brokers[broker] = _Broker(snapshot.version)
        elif known.version > snapshot.version:
            return
        known.version = snapshot.version
        numbers = {frame.id for frame in snapshot.declarations}  # type: ignore[union-attr]
        for number in [number for number in reversed(known.ids) if number not in numbers]:
            self._remove(broker, number)
        for frame in snapshot.declarations:
            if frame.id not in known.ids:  # type: ignore[union-attr]
                self._declare(broker, frame)

    def take_change(self, broker: int, change: Change) -> bool:
        """Take a change; return False if a snapshot is needed, because changes are missing."""
        known = self._brokers.get(broker)
        if known is None or change.version > known.version + 1:
            return False
        if change.version == known.version + 1:
            known.version = change.version
            if isinstance(change.frame, frames.Undeclare):
                self._remove(broker, change.frame.id)
            else:
                self._declare(broker, change.frame)
        return True

    def remove_broker(self, broker: int) -> None:
        """Remove all endpoints of a broker that is gone."""
        known = self._brokers.get(broker)
        if known is not None:
            for number in tuple(reversed(known.ids)):  # nodes after their endpoints
                self._remove(broker, number)
            del self._brokers[broker]

    def _declare(self, broker: int, frame: Any) -> None:
        remote = Remote(broker, frame.id)
        changed: dict[str, int] = {"id": next(self._ids)}
        if not isinstance(frame, frames.Node):
            node = self.id_of(broker, frame.node)
            if node is None:
                self.refused += 1
                return
            changed["node"] = node
        try:
            deliveries = self._router.handle(self._mesh, Mirror(frame._replace(**changed), remote.key))
        except (ProtocolError, Refusal, InvalidNameError):
            self.refused += 1
            return
        self._brokers[broker].ids[frame.id] = changed["id"]
        self._remotes[changed["id"]] = remote
        self._deliver(deliveries)

    def _remove(self, broker: int, number: int) -> None:
        endpoint = self._brokers[broker].ids.pop(number, None)
        if endpoint is not None:
            del self._remotes[endpoint]
            self._calls.server_left(endpoint)
            self._handle(frames.Undeclare(endpoint))

    def _handle(self, frame: Frame) -> None:
        self._deliver(self._router.handle(self._mesh, frame))
