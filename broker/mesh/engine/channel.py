"""The outbox from the router to the mesh: its frames become messages to other brokers."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from proto.queues.outbox import Outbox
from proto.wire.codec import Decoder, encode
from proto.wire.fragments import WholeFrames

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.engine.engine import Engine
    from broker.mesh.mesh import Mesh
    from broker.options import BrokerOptions
    from broker.routing.router import Router
    from proto.errors import ProtocolError
    from proto.wire.frames import Frame


class MeshChannel:
    """The outbox of one graph's mesh (`deliveries.Recipient`).

    Args:
        mesh: Turns frames into messages.
        router: The graph's router.
        engine: Sends them.
        options: Returns the broker's options.
        go_on_later: Lets the mesh go on with its work, and flushes, in a later loop turn.

    Attributes:
        mesh: As given.
        outbox: The frames that wait for the engine.
        held_bytes: Their size, as the memory guard has counted it last.
    """

    def __init__(
        self,
        mesh: Mesh,
        router: Router,
        engine: Engine,
        options: Callable[[], BrokerOptions],
        go_on_later: Callable[[], None] = lambda: None,
    ) -> None:
        self.mesh = mesh
        self.outbox = Outbox(transfers=WholeFrames())
        self.held_bytes = 0
        self._engine = engine
        self._router = router
        self._options = options
        self._go_on_later = go_on_later
        self._decoder = Decoder()

    @property
    def peer(self) -> int:
        """The router's number for all other brokers together, which are one peer to it."""
        return self.mesh.peer

    @property
    def has_unsent(self) -> bool:
        """Whether frames wait for the engine."""
        outbox = self.outbox
        return outbox.urgent_bytes > 0 or outbox.ordered_bytes > 0 or outbox.has_more

    def send(self, frame: Frame) -> None:
        """Queue a control frame."""
        self.outbox.put_control(encode(frame))

    def fail(self, error: ProtocolError) -> None:
        """Raise the error: the router reports brokers that are at fault, and never closes the mesh."""
        raise error

    def flush(self) -> None:
        """Send frames until the engine is full, then trim the publisher queues and apply the limits."""
        if self._is_idle():
            return
        outbox, engine = self.outbox, self._engine
        outbox.max_held_bytes = self._options().max_link_bytes  # a reload may have changed it
        self.mesh.overflows.handle()
        while not engine.full:
            parts, _ = outbox.pop_frames(1)
            if not parts:
                break
            head = parts[0] if len(parts) > 1 else b""  # of a large REPLAY
            raw = b"".join(parts) if head else parts[-1]
            # After each frame, so that `engine.full` counts it before the next one is popped.
            self.mesh.sender.send(self._decoder.decode(raw))
            self._pass_on()
        outbox.trim()
        if outbox.urgent_bytes or outbox.ordered_bytes or outbox.held_bytes:
            self._limit()
        self.mesh.wanted.update()
        self._pass_on()
        if self.mesh.busy:
            self._go_on_later()

    def _is_idle(self) -> bool:
        """Return whether there is nothing to do: of many graphs most have nothing at most flushes."""
        mesh, outbox = self.mesh, self.outbox
        waits = outbox.held_bytes or outbox.urgent_bytes or outbox.ordered_bytes or outbox.has_more
        return not (waits or mesh.out or mesh.busy or mesh.wanted.touched or mesh.overflows.noted)

    def _limit(self) -> None:
        """Reset the session with a broker, or with all, if more waits than the limits allow.

        A link would be closed. All brokers share the engine: if it is blocked, nobody knows which of them is
        slow. Only large replies are counted for each broker.
        """
        outbox, options, mesh = self.outbox, self._options(), self.mesh
        if outbox.bulk_bytes > options.max_bulk_bytes:
            waiting: Counter[int] = Counter()
            replies = {key: each for key, each in outbox.large_calls.items() if each.share is None}
            for (endpoint, _), reply in replies.items():
                waiting[mesh.sender.broker_of(endpoint)] += reply.control_bytes
            for broker, size in waiting.most_common(1):
                for key in replies:
                    if mesh.sender.broker_of(key[0]) == broker:
                        outbox.drop_call(key)
                text = f"{size} bytes of large replies wait for it (--max-bulk-bytes)"
                mesh.overflows.reset((broker,), text)
        if outbox.bulk_bytes > options.max_bulk_bytes:
            self.drop_all(f"{outbox.bulk_bytes} bytes of large replies wait (--max-bulk-bytes)")
        elif outbox.undroppable_bytes > options.max_queue_bytes:
            self.drop_all(f"{outbox.undroppable_bytes} bytes of replies wait (--max-queue-bytes)")
        elif outbox.held_bytes > options.max_link_bytes:
            self.drop_all(f"{outbox.held_bytes} bytes of messages wait (--max-link-bytes)")

    def drop_all(self, reason: str) -> None:
        """Drop everything that waits, and reset the sessions with all brokers.

        Args:
            reason: For the log.
        """
        routes, before = self._router.routes, self.outbox
        self.mesh.overflows.lost_all(f"{reason}, and the mesh accepts no more")  # empties queues in use
        for each in tuple(routes.departed.all()):
            if each.peer == self.mesh.peer:
                before.discard_queue(each.queue, shed=True)
        routes.prune(at_least=0)  # no queue of the earlier outbox is used again
        self.outbox = Outbox(transfers=WholeFrames())
        self.outbox.dropped = before.dropped

    def ask(self) -> None:
        """Send a request for a snapshot, if one is due: each takes 0.1 ms."""
        self._pass_on(asks=1)

    def _pass_on(self, asks: int = 0) -> None:
        if messages := self.mesh.pop_messages(asks):
            self._engine.send(self._router.domain, messages)
