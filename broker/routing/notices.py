"""What the router reports to endpoints beside messages and calls.

NOTICE frames tell of pairs that do not fit, MATCHED frames count counterparts, and ASSERT frames, publishers'
signs of liveliness, are forwarded to readers. They are combined until `Router.report`, once in a loop turn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.access.rules import Action
from broker.routing.deliveries import Send
from proto import limits
from proto.wire import frames
from proto.wire.codes import NoticeKind
from proto.wire.frames import Assert

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.records import Endpoint, Peer, PublisherRecord
    from broker.routing.routes import Routes


MAX_NOTICES: Final = 16
"""Mismatches and stalls reported one by one to one endpoint at a time; one more NOTICE of each kind counts
the others. Each of the counterparts gets its own NOTICE in any case."""


def type_difference(one: str, other: str) -> str:
    """Return how two types with these names, which do not match, differ, and how to fix a common mistake."""
    if one == other:
        return "the definitions of the type differ"
    if one.rpartition("/")[2] != other.rpartition("/")[2]:
        return "the types differ"
    return (
        "the types differ. If they are one class in two scripts, put it in a module that both import, or give"
        " both classes the same type_name="
    )


class Notices:
    """The reports about matching in one graph.

    Args:
        emit: Takes each delivery.
    """

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit
        self._newcomer: Endpoint | None = None
        self._reported = 0
        self._unreported: dict[NoticeKind, frames.Notice] = {}
        """Summaries of the notices beyond MAX_NOTICES."""
        self._changed: dict[Endpoint, None] = {}

    def begin(self, newcomer: Endpoint) -> None:
        """Begin to report to an endpoint about many others, as when it is new or back."""
        self._newcomer, self._reported = newcomer, 0

    def report(self, endpoint: Endpoint, kind: NoticeKind, text: str, policy: int = 0) -> None:
        """Tell one endpoint of a pair about the other."""
        text = text[: limits.MAX_ERROR_TEXT]
        newcomer = endpoint is self._newcomer
        self._reported += newcomer
        if not newcomer or self._reported <= MAX_NOTICES:
            self._emit(Send(endpoint.peer.id, frames.Notice(endpoint.id, kind, text, policy, 1)))
            return
        before = self._unreported.get(kind)
        count = 1 if before is None else before.peers + 1
        text = f"'{endpoint.name}': the same with {count} more"
        self._unreported[kind] = frames.Notice(endpoint.id, kind, text, policy, count)

    def send(self, endpoint: Endpoint, kind: NoticeKind, text: str) -> None:
        """Tell an endpoint something that does not concern a match."""
        notice = frames.Notice(endpoint.id, kind, text[: limits.MAX_ERROR_TEXT], 0, 1)
        self._emit(Send(endpoint.peer.id, notice))

    def report_types(self, one: Endpoint, one_role: str, other: Endpoint, other_role: str) -> None:
        """Tell both endpoints of a pair that they are not connected because their types differ."""
        text = (
            f"'{one.name}' is not connected between the {one_role} {one.node_name} ({one.type_name})"
            f" and the {other_role} {other.node_name} ({other.type_name}):"
            f" {type_difference(one.type_name, other.type_name)}"
        )
        for endpoint, counterpart, role in ((one, other, other_role), (other, one, one_role)):
            visible = endpoint.peer.may(Action.SEE, counterpart.node_name)
            hidden = (
                f"'{one.name}' is not connected with a {role} that this user may not see: the types differ"
            )
            self.report(endpoint, NoticeKind.INCOMPATIBLE_TYPE, text if visible else hidden)

    def end(self) -> None:
        """Report to the endpoint of `begin` how many were not reported one by one."""
        assert self._newcomer is not None
        for notice in self._unreported.values():
            self._emit(Send(self._newcomer.peer.id, notice))
        self._unreported.clear()
        self._newcomer = None

    def set_count(self, endpoint: Endpoint, count: int) -> None:
        """Set an endpoint's number of counterparts, to be reported by `flush`."""
        if endpoint.peers != count:
            endpoint.set_peers(count)
            self._changed[endpoint] = None

    def flush(self) -> None:
        """Send MATCHED to every declared endpoint whose number of counterparts has changed."""
        if self._changed:
            changed, self._changed = self._changed, {}
            for endpoint in changed:
                if endpoint.peer.endpoints.get(endpoint.id) is not endpoint:
                    continue
                self._emit(Send(endpoint.peer.id, endpoint.matched_frame()))


class Assertions:
    """The ASSERTs that have not been forwarded yet.

    Args:
        emit: Takes each delivery.
        routes: Knows the publishers.
    """

    def __init__(self, emit: Callable[[Delivery], None], routes: Routes) -> None:
        self._emit = emit
        self._routes = routes
        self._asserted: dict[int, PublisherRecord] = {}

    def add(self, peer: Peer, frame: Assert) -> None:
        """Forward a publisher's ASSERT to its readers with the next `report`.

        Raises:
            ProtocolError: The publisher is not this peer's.
        """
        publisher = self._routes.publisher(peer, frame.publisher)
        self._asserted[publisher.key] = publisher

    def report(self) -> None:
        """Forward the ASSERTs since the last call, one for each publisher, to its readers."""
        if self._asserted:
            asserted, self._asserted = self._asserted, {}
            for publisher in asserted.values():
                for route in publisher.routes.values():
                    self._emit(Send(route.peer.id, Assert(publisher.key)))
