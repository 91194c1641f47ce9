"""The broker's side of one client's link: its identity, state and limits."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Final

from broker.access.origin import UNKNOWN
from proto.errors import ErrorCode, ProtocolError
from proto.liveness import Liveness
from proto.wire import frames
from proto.wire.session import State
from proto.wire.stats import MAX_NODE_NAMES

if TYPE_CHECKING:
    from broker.access.origin import Origin
    from broker.access.rules import Principal
    from broker.options import BrokerOptions
    from broker.routing.router import Router
    from broker.serving.shared_memory import LinkMemory
    from proto.aio.budgeted_channel import BudgetedChannel
    from proto.queues.outbox import Outbox

logger: Final = logging.getLogger("callboard.broker")

CATCH_UP: Final = 1
"""The token of the PING that follows a hold. Frames keep their order: when its PONG arrives, everything that
the client sent before it learnt of the hold has arrived, too."""


class Link:
    """One client's link.

    Args:
        channel: Its bytes.
        options: The broker's limits.
        now: Loop time.

    Attributes:
        router: The router of the graph it has joined; None before the handshake and after it has left.
        peer: Its number in that graph.
        session: Its number in the broker; 0 before the handshake.
        agent: The client's software and version, sanitized.
        address: Its host and port, or "unix socket", and the address of the client that it claims to serve.
        origin: Where it comes from.
        principal: Its user; None if there are no access rules, or before the handshake.
        rejected: Why it has no user. Set if the refusal is delayed, which slows down guessing.
        opened_at: Loop time when it was opened.
        check_at: Loop time of the next keepalive check, even if nothing relies on the link.
        suspended_at: Loop time since which it is suspended for silence, or None.
        was_relied_on: Whether something relied on the link at the last keepalive check.
        behind: Whether frames that it sent before the broker's hold may still arrive.
        left: Whether it ends because the client or the broker stops on purpose; then its nodes are not logged
            as dead.
        ending: Why it ends; "" until that is known.
        held_bytes: What waits for it, as last counted by the memory guard.
        memory: The shared memory of the link; None if the client is not on the broker's host.
    """

    def __init__(self, channel: BudgetedChannel, options: BrokerOptions, now: float) -> None:
        self.channel = channel
        self.reconfigure(options)
        self.router: Router | None = None
        self.peer = 0
        self.session = 0
        self.agent = "?"
        self.address = "?"
        self.origin: Origin = UNKNOWN
        self.principal: Principal | None = None
        self.rejected = ""
        self.opened_at = now
        self.check_at = 0.0
        self.suspended_at: float | None = None
        self.was_relied_on = False
        self.behind = False
        self.left = False
        self.ending = ""
        self.held_bytes = 0
        self.memory: LinkMemory | None = None
        self.liveness = Liveness(now)

    def reconfigure(self, options: BrokerOptions) -> None:
        """Apply the broker's limits from now on."""
        self._options = options
        self.channel.outbox.max_held_bytes = options.max_link_bytes

    def fail(self, code: ErrorCode, text: str) -> None:
        """Send ERROR with the reason, and close."""
        self.channel.fail(ProtocolError(code, text))

    def fail_if_over_limit(self) -> None:
        """Close the link if more waits for it than its limits allow, and none of it may be dropped."""
        outbox, options = self.channel.outbox, self._options
        # Large replies first: a peer that reads fast can exceed this limit, too, so the text blames nobody.
        if outbox.bulk_bytes > options.max_bulk_bytes:
            text = (
                f"{outbox.bulk_bytes} bytes of large replies wait for this link, over the limit of"
                f" {options.max_bulk_bytes} (the broker's --max-bulk-bytes)"
            )
        elif outbox.undroppable_bytes > options.max_queue_bytes:
            text = _too_slow("replies and control frames", options.max_queue_bytes, "--max-queue-bytes")
        elif outbox.held_bytes > options.max_link_bytes:
            text = _too_slow("messages that must not be dropped", options.max_link_bytes, "--max-link-bytes")
        else:
            return
        self.fail(ErrorCode.LIMIT, text)

    def refuse(self, code: ErrorCode, text: str) -> None:
        """Send ERROR to a peer without a session, and close, once; the refusal is not logged here."""
        if not self.channel.connected:
            return
        # Not `fail`, which logs a warning: callers that want one have logged their own.
        self.channel.send(frames.Error(code, text))
        self.channel.flush()
        self.channel.close()

    def request_catch_up(self) -> None:
        """Ask a peer with a session to confirm that it has received everything sent so far."""
        if self.channel.session.state is State.OPEN:
            self.behind = True
            self.channel.send(frames.Ping(CATCH_UP))

    @property
    def outbox(self) -> Outbox:
        """What waits for it."""
        return self.channel.outbox

    @property
    def has_unsent(self) -> bool:
        """Whether unsent frames remain for a peer that may still read them."""
        if not self.channel.connected or self.suspended_at is not None:
            return False
        outbox = self.channel.outbox
        # Blocked queues wait for credit or slots; the outbox does not count them among `has_more`.
        waits = outbox.urgent_bytes > 0 or outbox.ordered_bytes > 0
        return waits or outbox.has_more or any(queue.pending for queue in outbox.blocked)

    def send_goodbye(self) -> None:
        """Send GOODBYE because the broker stops; the peer closes when it has read everything."""
        if self.channel.session.state is State.OPEN:
            self.channel.send(frames.Goodbye("the broker is stopping"))
            self.channel.flush()
        else:
            self.channel.close()

    def silent_sec(self, now: float) -> float:
        """Return the seconds without a sign of life, as of the last keepalive check."""
        return self.liveness.silent_s(now, self.channel.bytes_received)

    def __str__(self) -> str:
        peer = None if self.router is None else self.router.peer(self.peer)
        nodes = [] if peer is None else peer.node_names()
        # A link may have thousands of nodes, and this is in lines of the log.
        more = [f"{len(nodes) - MAX_NODE_NAMES} more nodes"] if len(nodes) > MAX_NODE_NAMES else []
        where = ", ".join((*nodes[:MAX_NODE_NAMES], *more, self.address))
        return f"link {self.peer or '(no handshake)'} [{self.agent}] ({where})"


def _too_slow(what: str, limit: int, option: str) -> str:
    return (
        f"more than {limit} bytes of {what} wait for this link: it reads too slowly (the broker's {option})"
    )
