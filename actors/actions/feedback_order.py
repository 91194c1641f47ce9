"""Results that have overtaken feedback: they wait for it.

Replies overtake messages on a link that is congested. So the reply with a result says how far the server's
feedback had come, and the client holds the result back until that feedback has been handed over.
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
"""How long a result waits for feedback: it may wait for the node's other callbacks, or never arrive."""

GID: Final = "after_gid"
SEQUENCE: Final = "after_sequence"


class FeedbackEnd(NamedTuple):
    """The last feedback that a server had published when it replied."""

    gid: bytes
    """Identifies the publisher of the feedback."""
    sequence: int
    """The number after its last message."""

    @classmethod
    def of(cls, attributes: Options | None) -> FeedbackEnd | None:
        """Return what the attributes of a reply say; None if they do not, or are not valid."""
        # From another process, perhaps another version: anything may be missing, or of another type.
        values: Options = attributes or {}
        gid, sequence = values.get(GID), values.get(SEQUENCE)
        if isinstance(gid, bytes) and isinstance(sequence, int):
            return cls(gid, sequence)
        return None


def attributes_after(feedback: Publisher[Any]) -> Options | None:
    """Return the attributes of a reply that follows what was published so far."""
    return {GID: feedback.gid, SEQUENCE: feedback.published} if feedback.published else None


class HeldResults:
    """The results of one action client that wait for feedback.

    Args:
        subscription: To the feedback.
    """

    def __init__(self, subscription: SubscriptionEndpoint) -> None:
        self._subscription = subscription
        self._held: dict[Callable[[], None], tuple[FeedbackEnd, asyncio.TimerHandle]] = {}

    def hold(self, attributes: Options | None, release: Callable[[], None]) -> None:
        """Call `release` when the feedback has been handed over, or lost, that a reply's attributes name."""
        end = FeedbackEnd.of(attributes)
        if end is None or self._subscription.destroyed or self._arrived(end):
            release()
            return
        loop = self._subscription.context.require_loop()
        # With a limit: feedback may have been dropped by a depth, or wait for a callback that does not end,
        # and the result must not wait for ever.
        self._held[release] = end, loop.call_later(MAX_WAIT_SEC, self._release, release)

    def check(self) -> None:
        """Release results, after feedback has been handed over."""
        for release, (end, _) in tuple(self._held.items()):
            if self._arrived(end):
                self._release(release)

    def release_all(self) -> None:
        """Release all results: no more feedback is handed over."""
        for release in tuple(self._held):
            self._release(release)

    def _release(self, release: Callable[[], None]) -> None:
        _, timer = self._held.pop(release)
        timer.cancel()
        release()

    def _arrived(self, end: FeedbackEnd) -> bool:
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
