"""The endpoints of other brokers, declared to this broker's router as those of one peer."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count, islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from broker.access.rules import Action
from broker.routing.mirrored import Mirror
from broker.routing.records import NodeRecord
from proto.errors import ErrorCode, InvalidNameError, ProtocolError
from proto.wire import frames
from proto.wire.mesh_keys import mesh_key
from proto.wire.qos import Refusal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from broker.access.rules import Rights
    from broker.mesh.calls import MeshCalls
    from broker.mesh.messages import Change, Snapshot
    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router
    from proto.wire.frames import Frame


_ACTIONS: Final[dict[type[Any], Action]] = {
    frames.Node: Action.NODE,
    frames.Publisher: Action.PUBLISH,
    frames.Subscription: Action.SUBSCRIBE,
    frames.Service: Action.SERVE,
    frames.Client: Action.CALL,
}


class Remote(NamedTuple):
    """An endpoint of another broker."""

    broker: int
    number: int

    @property
    def key(self) -> int:
        """Its key in the mesh."""
        return mesh_key(self.broker, self.number)


@dataclass(slots=True)
class _Broker:
    """Another broker: the last of its changes that is known, and its endpoints, each with its id here.

    The id is 0 for an endpoint that the router refuses. `too_many`: whether others are not even here.
    """

    version: int
    ids: dict[int, int] = field(default_factory=dict[int, int])
    too_many: bool = False


class MeshImports:
    """The endpoints of all other brokers in one graph.

    Args:
        router: The graph's router.
        peer: The id of the router's peer for the mesh.
        calls: The calls to other brokers.
        deliver: Takes what the router returns.
        report_refusal: Called with a broker and why an endpoint of it is refused.
        count_change: Called with a broker of which an endpoint comes or goes.
        max_endpoints: Nodes and endpoints that one broker may declare. Others are refused.

    Attributes:
        refused: Declarations that this broker's router does not take.
        rights: What the nodes of other brokers may do here; None for everything.
    """

    def __init__(
        self,
        router: Router,
        peer: int,
        calls: MeshCalls,
        deliver: Callable[[list[Delivery]], None],
        report_refusal: Callable[[int, str], None],
        *,
        count_change: Callable[[int], None],
        max_endpoints: int,
    ) -> None:
        self._router = router
        self._peer = peer
        self._calls = calls
        self._deliver = deliver
        self._report_refusal = report_refusal
        self._count_change = count_change
        self._max_endpoints = max_endpoints
        self._ids = count(1)
        self._brokers: dict[int, _Broker] = {}
        self._remotes: dict[int, Remote] = {}
        self.refused = 0
        self.rights: Rights | None = None

    def version(self, broker: int) -> int:
        """Return how many changes of a broker are known."""
        known = self._brokers.get(broker)
        return 0 if known is None else known.version

    def id_of(self, broker: int, number: int) -> int | None:
        """Return the id of another broker's endpoint at the router; None if it is unknown."""
        known = self._brokers.get(broker)
        return None if known is None else known.ids.get(number) or None

    def remote(self, endpoint: int) -> Remote | None:
        """Return which endpoint has an id at the router; None if it has gone."""
        remote = self._remotes.get(endpoint)
        # Endpoints of a broker that is gone are removed one after the other.
        return remote if remote is not None and remote.broker in self._brokers else None

    def accept_snapshot(self, broker: int, snapshot: Snapshot) -> Iterator[None]:
        """Replace what is known of a broker, one declaration at a step.

        Raises:
            ProtocolError: A declaration is malformed, a number is there twice, or an endpoint comes before
                its node.
        """
        known = self._brokers.get(broker)
        if known is None:
            known = self._brokers[broker] = _Broker(snapshot.version)
        elif known.version > snapshot.version:
            return
        known.version = snapshot.version
        surplus = max(0, len(snapshot.declarations) - self._max_endpoints)
        taken = len(snapshot.declarations) - surplus
        # Its declarations are decoded twice: kept, those of many brokers would take much memory.
        numbers: set[int] = set()
        for frame in islice(snapshot.declarations, taken):
            numbers.add(frame.id)  # type: ignore[union-attr]
            yield
        if len(numbers) < taken:
            raise ProtocolError(ErrorCode.UNEXPECTED, "its snapshot has a number twice")
        # Backwards, as endpoints come after their nodes. What both have stays as it is: its matches and
        # credit go on.
        for number in [number for number in reversed(known.ids) if number not in numbers]:
            self._remove(broker, known, number)
            yield
        for frame in islice(snapshot.declarations, taken):
            if frame.id not in known.ids:  # type: ignore[union-attr]
                self._declare(broker, known, frame)
            yield
        if surplus:
            self._refuse_surplus(broker, known, surplus)

    def accept_change(self, broker: int, change: Change) -> bool:
        """Take a change; return False if a snapshot is needed, because changes are missing.

        Raises:
            ProtocolError: It contradicts earlier ones.
        """
        known = self._brokers.get(broker)
        if known is None or change.version > known.version + 1:
            return False
        if change.version == known.version + 1:
            known.version = change.version
            if isinstance(change.frame, frames.Undeclare):
                self._undeclare(broker, known, change.frame.id)
            elif isinstance(change.frame, frames.Retire):
                self._handle(frames.Retire(known.ids.get(change.frame.id, 0)))
            else:
                self._declare(broker, known, change.frame)
        return True

    def remove_broker(self, broker: int) -> Iterator[None]:
        """Forget a broker that is gone; return what removes its endpoints, one at a step."""
        known = self._brokers.pop(broker, None)
        return iter(()) if known is None else self._remove_all(broker, known)

    def _remove_all(self, broker: int, known: _Broker) -> Iterator[None]:
        # From the end: nodes after their endpoints. The numbers go one by one, too: they lie between the
        # records, so that the memory of all would be free with the last of them: 25 ms for 100,000.
        numbers = [*known.ids]
        while numbers:
            self._remove(broker, known, numbers.pop())
            yield
        peer = self._router.peer(self._peer)
        if peer is not None:
            peer.brokers.pop(broker, None)

    def _undeclare(self, broker: int, known: _Broker, number: int) -> None:
        record = self._router.endpoint(self._peer, known.ids.get(number, 0))
        if isinstance(record, NodeRecord) and record.endpoints:
            text = f"it has removed the node {number} before its endpoints"
            raise ProtocolError(ErrorCode.UNEXPECTED, text)
        self._remove(broker, known, number)

    def _declare(self, broker: int, known: _Broker, frame: Any) -> None:
        number = frame.id
        if number in known.ids:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"it has declared the number {number} twice")
        self._count_change(broker)
        changed: dict[str, int] = {"id": next(self._ids)}
        if not isinstance(frame, frames.Node):
            node = known.ids.get(frame.node, 0 if known.too_many else None)
            if node is None:
                text = f"it has declared {number} for the node {frame.node}, which it does not have"
                raise ProtocolError(ErrorCode.UNKNOWN_ID, text)
            changed["node"] = node
        if len(known.ids) >= self._max_endpoints:
            self._refuse_surplus(broker, known, 1)
            return
        # Known even if it is refused below: its endpoints, its UNDECLARE and its RETIRE must find it.
        known.ids[number] = 0
        remote = Remote(broker, number)
        action, name = _ACTIONS[type(frame)], str(getattr(frame, "name", "") or getattr(frame, "topic", ""))
        if self.rights is not None and not self.rights.may(action, name):
            self._refuse(broker, f"the access rules do not import '{name}' ({action.value})")
            return
        try:
            deliveries = self._router.handle(self._peer, Mirror(frame._replace(**changed), remote.key))
        except (Refusal, InvalidNameError) as error:
            self._refuse(broker, str(error))
            return
        known.ids[number] = changed["id"]
        self._remotes[changed["id"]] = remote
        self._deliver(deliveries)

    def _refuse_surplus(self, broker: int, known: _Broker, count: int) -> None:
        known.too_many = True
        text = f"one broker may declare {self._max_endpoints} endpoints (--max-mesh-endpoints)"
        self._refuse(broker, text, count)

    def _refuse(self, broker: int, text: str, count: int = 1) -> None:
        self.refused += count
        self._router.refusals.count += count
        self._report_refusal(broker, text)

    def _remove(self, broker: int, known: _Broker, number: int) -> None:
        endpoint = known.ids.pop(number, 0)
        self._count_change(broker)
        if endpoint:
            del self._remotes[endpoint]
            # First: the router answers the calls as it handles the frame, and answers that come late must
            # find nothing.
            self._calls.server_left(endpoint)
            self._handle(frames.Undeclare(endpoint))

    def _handle(self, frame: Frame) -> None:
        self._deliver(self._router.handle(self._peer, frame))
