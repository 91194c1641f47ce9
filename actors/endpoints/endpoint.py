"""What publishers, subscriptions, services and clients have in common.

Each has two objects: a `Handle`, which users hold, and an `Endpoint`, which the link, the mailbox and the
node call. A handle keeps the method that is called once per message, so that it costs no further call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from actors.errors import NodeDestroyed
from actors.session.endpoint import LinkEndpoint

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import EndpointEvents
    from proto.wire import frames


class Endpoint(LinkEndpoint):
    """What the runtime calls.

    Attributes:
        kind: Its name in messages.
        context: The node.
        events: Its QoS events; None if it has none.
        interface: Its message or service class; None for one of every type.
        peers: How many counterparts it has now.
        destroyed: Whether it is out of service.
        refusal: Why the broker of this session has refused it; "" if it has not.
        standard: Whether every node, or every lifecycle node, has it. The broker may refuse it, and needs no
            definition of its type.
    """

    kind: ClassVar = "endpoint"
    standard = False
    interface: type[Any] | None = None

    def __init__(self, context: NodeContext, events: EndpointEvents | None = None) -> None:
        context.require_alive()
        context.link.require_thread()
        self.context = context
        self.events = events
        self.peers = 0
        self.destroyed = False
        self.refusal = ""
        context.endpoints[self] = None

    def require_alive(self) -> None:
        """Raise NodeDestroyed if the endpoint or its node has been destroyed."""
        if self.destroyed:
            raise NodeDestroyed(f"This {self.kind} has been destroyed")

    def retire(self) -> None:
        """Begin nothing new, as the node stops. Callbacks that still run may go on using the endpoint."""

    def destroy(self) -> None:
        """Take the endpoint out of service. A second call does nothing."""
        if self.destroyed:
            return
        self.context.link.require_thread()
        self.destroyed = True
        self.context.endpoints.pop(self, None)
        if self.events is not None:
            self.events.stop()
        self.context.link.remove(self)
        self.context.link.wake()

    def refused(self, code: int, text: str) -> None:
        """Note and log that the broker has refused the declaration."""
        del code
        # Of a refused node the broker knows nothing, and says of its endpoints no more than that.
        self.refusal = self.context.refusal or text or "it gives no reason"
        self.context.link.wake()
        if self.context.refusal:
            self.context.log.debug(f"The broker refused a {self.kind} of '{self.context.full_name}': {text}")
        elif self.standard:
            self.context.log.debug(f"The broker refused a standard {self.kind}: {text}")
        elif self.context.may_log("refusals of the broker"):
            self.context.log.error(f"The broker refused a {self.kind}: {text}")

    def matched(self, peers: int, total: int) -> None:
        """Note how many counterparts there are now, and how many there have been in this session."""
        self.peers = peers
        if self.events is not None:
            self.events.matched_now(peers, total)
        self.context.link.wake()

    def notice(self, notice: frames.Notice) -> None:
        """Take a warning of the broker."""
        if self.events is not None:
            self.events.notice(notice)
        else:
            self.context.warn_of(notice)

    def time_shifted(self, seconds: float) -> None:
        """Correct points in time of `NodeContext.time`, which has jumped."""

    def session_ended(self) -> None:
        """Forget the counterparts and the refusal."""
        self.peers = 0
        self.refusal = ""
        if self.events is not None:
            self.events.session_ended()


E = TypeVar("E", bound=Endpoint)


class Handle(Generic[E]):
    """What users hold of an endpoint."""

    def __init__(self, endpoint: E) -> None:
        self._endpoint = endpoint

    @property
    def id(self) -> int:
        """Its number on its node's link, as in the node's diagnostics; it keeps it across reconnects."""
        return self._endpoint.id

    @property
    def peers(self) -> int:
        """How many counterparts are matched now."""
        return self._endpoint.peers

    @property
    def refusal(self) -> str:
        """Why the broker of this session has refused it; "" if it has not, or not yet.

        Rules that a broker reads later may refuse it at any time.
        """
        return self._endpoint.refusal

    @property
    def destroyed(self) -> bool:
        """Whether it has been destroyed, by itself or with its node."""
        return self._endpoint.destroyed

    def destroy(self) -> None:
        """Take it out of service. A second call does nothing."""
        self._endpoint.destroy()


def endpoint_of(handle: Handle[E]) -> E:
    """Return the endpoint behind a handle, for the runtime's own use."""
    return handle._endpoint  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]
