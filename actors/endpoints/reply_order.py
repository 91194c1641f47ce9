"""Replies that have overtaken messages: they wait for them.

Replies overtake messages on a link that is congested. So a reply says how far a publisher of the server had
come, as the reply with a goal's result does of the feedback, and the client holds it back until the messages
before it have been handed over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from actors.endpoints.publisher.publisher import Publisher
    from actors.endpoints.subscription.endpoint import SubscriptionEndpoint
    from proto.wire.frames import Options

MAX_WAIT_SEC: Final = 1.0
"""How long a reply waits for messages: they may wait for the node's other callbacks, or never arrive."""

MAX_HELD: Final = 1000
"""Replies of one client that wait; others do not."""

GID: Final = "after_gid"
SEQUENCE: Final = "after_sequence"


class LastMessage(NamedTuple):
    """The last message that a server had published when it replied."""

    gid: bytes
    """Identifies the publisher."""
    sequence: int
    """The number after its last message."""

    @classmethod
    def of(cls, attributes: Options | None) -> LastMessage | None:
        """Return what the attributes of a reply say; None if they do not, or are not valid."""
        # From another process, perhaps another version: anything may be missing, or of another type.
        values: Options = attributes or {}
        gid, sequence = values.get(GID), values.get(SEQUENCE)
        if isinstance(gid, bytes) and isinstance(sequence, int):
            return cls(gid, sequence)
        return None


def attributes_after(publisher: Publisher[Any]) -> Options | None:
    """Return the attributes of a reply that follows what was published so far."""
    return {GID: publisher.gid, SEQUENCE: publisher.published} if publisher.published else None


class HeldReplies:
    """The replies of one client that wait for messages.

    Args:
        subscription: To these messages, with a callback.
    """

    def __init__(self, subscription: SubscriptionEndpoint) -> None:
        self._subscription = subscription
        callback = subscription.consumer.callback
        assert callback is not None

        def handed_over(*args: Any) -> Any:
            try:
                return callback(*args)
            # Also if the callback has raised: this message has been handed over all the same.
            finally:
                self.check()

        subscription.consumer.callback = handed_over
        self._held: dict[Callable[[], None], tuple[LastMessage, asyncio.TimerHandle]] = {}

    def hold(self, attributes: Options | None, release: Callable[[], None]) -> None:
        """Call `release` when the messages have been handed over, or lost, that a reply's attributes name."""
        end = LastMessage.of(attributes)
        if end is None or self._subscription.destroyed or self._arrived(end) or len(self._held) >= MAX_HELD:
            release()
            return
        loop = self._subscription.context.require_loop()
        # With a limit: messages may have been dropped by a depth, or wait for a callback that does not end,
        # and the reply must not wait for ever.
        self._held[release] = end, loop.call_later(MAX_WAIT_SEC, self._release, release)

    def check(self) -> None:
        """Release replies, after a message has been handed over."""
        for release, (end, _) in tuple(self._held.items()):
            if self._arrived(end):
                self._release(release)

    def release_all(self) -> None:
        """Release all replies: nobody waits for messages any more."""
        for release in tuple(self._held):
            self._release(release)

    def _release(self, release: Callable[[], None]) -> None:
        _, timer = self._held.pop(release)
        timer.cancel()
        release()

    def _arrived(self, end: LastMessage) -> bool:
        subscription = self._subscription
        attachment = subscription.tracker.attachments.get(end.gid)
        if attachment is None:
            # Not attached yet, though there are publishers. A publisher that was attached before and is
            # gone (it is in `known`) sends nothing more.
            if subscription.peers and end.gid not in subscription.tracker.known:
                return False  # it is still to come
        # Not received yet, as far as the numbers go. Lost ones count as received: nobody waits for them.
        elif attachment.expected < end.sequence:
            return False
        # Received, but not handed to the callback.
        return not any(
            batch.attachment.gid == end.gid and batch.numbers[batch.index] < end.sequence
            for batch in subscription.consumer.backlog.batches
        )
