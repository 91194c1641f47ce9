"""The context of a bare node: a node of its own in the graph, with the parts of the node that owns it."""

from __future__ import annotations

from itertools import starmap
from typing import TYPE_CHECKING

from actors.endpoints.context import NodeContext
from actors.endpoints.departing import DEPARTING_SLACK
from actors.endpoints.events import Event
from actors.endpoints.publisher.endpoint import PublisherEndpoint
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codes import Capability
from proto.wire.names import full_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.session.endpoint import LinkEndpoint
    from proto.queues.publisher_queue import PublisherQueue


class BareContext(NodeContext):
    """What the endpoints of a bare node share. The owner's runner treats it as one of the owner's endpoints.

    Attributes:
        owner: The context of the node whose link, mailbox, clock and log it uses.
        apart: Endpoints of nodes with the same text do not match.
        yields_name: Whether a node that does not share its name takes this one's.
        name_taken: Whether the broker of this session has refused it because another node has its name.
    """

    owns_link = False
    interface = None

    def __init__(
        self,
        owner: NodeContext,
        *,
        name: str,
        namespace: str,
        labels: Mapping[str, str],
        apart: str,
        shared_name: bool,
        yields_name: bool,
        on_refused: Callable[[str], object] | None,
    ) -> None:
        owner.require_alive()
        owner.link.require_thread()
        # Not its own, but the owner's: link, log, mailbox, clocks, watch, departing queues, warnings, and the
        # defaults of endpoints.
        vars(self).update(vars(owner))
        self.owner = owner
        self.name = name
        self.namespace = namespace
        self.full_name = full_node_name(namespace, name)
        self.labels = dict(labels)
        self.apart = apart
        self.shared_name = shared_name
        self.yields_name = yields_name
        self.declared = False
        self.refusal = self._reason = ""
        self.name_taken = False
        self.unread = 0
        self.endpoints = {}
        self.timers = {}
        self._refused_event: Event | None = None
        if on_refused is not None:
            self._refused_event = Event(self, f"'{self.full_name}'", lambda *_: self._reason, on_refused)
        self._unsent: list[tuple[int, PublisherQueue]] = []
        """The ids and queues of its destroyed publishers, which may have sent everything by now."""
        self._most = DEPARTING_SLACK
        """How many of them to keep before all are looked at."""
        self._replies = False
        """Whether replies of its destroyed services may wait."""
        owner.endpoints[self] = None
        self.link.add(self)

    def callback_failed(self, what: str, error: BaseException) -> None:
        """Handle an error of a callback as the owner does."""
        self.owner.callback_failed(what, error)

    def declaration(self) -> frames.Frame:
        """Declare the node, unless the broker would let its endpoints match those from which it is kept."""
        if self.apart and Capability.APART not in self.link.capabilities:
            url = self.link.url
            text = f"the broker at {url} does not know nodes that are kept apart; update it"
            # Not now: endpoints must not be told of a refusal before they are declared.
            if self.link.loop is not None:
                self.link.loop.call_soon(self.refused, ErrorCode.UNEXPECTED, text)
            return frames.Undeclare(self.id)  # an unknown id, which brokers ignore; they refuse its endpoints
        frame = super().declaration()
        assert isinstance(frame, frames.Node)
        return frame._replace(apart=self.apart, yields=self.yields_name)

    def accepted(self, number: int) -> None:
        """Note that the node is in the graph."""
        del number
        self.declared = True
        self.refusal, self.name_taken = "", False
        self.link.wake()

    def refused(self, code: int, text: str) -> None:
        """Note, log and report that the broker has refused the node."""
        if self.destroyed:
            return
        self.declared = True
        self.refusal = self._reason = text or "it gives no reason"
        self.name_taken = code == ErrorCode.NAME_TAKEN
        self.link.wake()
        if self.yields_name and self.name_taken:
            self.log.debug(f"The node '{self.full_name}' has yielded its name: {text}")
        elif self.may_log("refusals of the broker"):
            self.log.error(f"The broker refused the node '{self.full_name}': {text}")
        if self._refused_event is not None:
            self._refused_event.add(1)

    def session_ended(self) -> None:
        """Forget the declaration, and what had been declared and destroyed, which is lost with the session.

        Destroyed publishers that had not been accepted are declared in the next session, and send then.
        """
        self.declared = False
        self.refusal, self.name_taken = "", False
        self._unsent = [each for each in self._unsent if each[0] in self.link.endpoints]
        self._replies = False

    # What a node calls on its endpoints

    def time_shifted(self, seconds: float) -> None:
        """Correct points in time of its endpoints."""
        for endpoint in self.endpoints:
            endpoint.time_shifted(seconds)

    def retire(self) -> None:
        """Begin nothing new, as the owner stops."""
        self.stopping = True
        for endpoint in tuple(self.endpoints):
            endpoint.retire()
        self.owner.unread += self.unread
        self.unread = 0

    def destroy(self) -> None:
        """Take the node and its endpoints out of service. It leaves the graph once its messages are sent."""
        if self.destroyed:
            return
        self.link.require_thread()
        self.stopping = self.owner.stopping
        for endpoint in tuple(self.endpoints):
            endpoint.destroy()
        self.destroyed = True
        if self._refused_event is not None:
            self._refused_event.stop()
        self.owner.endpoints.pop(self, None)
        self.link.leaving[self] = None
        # Usually all is sent now, so that it leaves, and its name is free for the next declaration.
        if self._unsent or self._replies:
            self.link.flush()
        else:
            self.link.wake()

    def leaves_after(self, endpoint: LinkEndpoint) -> None:
        """Let an endpoint that was destroyed send everything before the node leaves the graph."""
        if not isinstance(endpoint, PublisherEndpoint):
            self._replies = True
            return
        if len(self._unsent) >= self._most:  # publishers may come and go for as long as the node lives
            self._unsent = [each for each in self._unsent if not self._has_sent(*each)]
            self._most = DEPARTING_SLACK + 2 * len(self._unsent)
        self._unsent.append((endpoint.id, endpoint.queue))

    def _has_sent(self, publisher: int, queue: PublisherQueue) -> bool:
        return queue.empty and publisher not in self.link.endpoints

    def leave_if_sent(self) -> bool:
        """Leave the graph if nothing waits to be sent any more; return whether it has left.

        UNDECLARE of a node removes its endpoints, and would overtake their messages and replies.
        """
        link = self.link
        if not all(starmap(self._has_sent, self._unsent)):
            return False
        if self._replies and not link.sent:
            return False
        link.remove(self)
        return True
