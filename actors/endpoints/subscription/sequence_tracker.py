"""Sequence numbers that a subscription has received: repetitions are dropped, gaps are counted.

Sequence numbers are the publisher's, and continue across reconnects. When a publisher comes back, the
messages between the last one received and its first batch were lost on the break. For a subscription that
wants latched messages this is not final before the first live batch: latched ones may fill the gap, now or at
the next attachment.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from actors.endpoints.events import Event
    from actors.session.attachments import Attachment
    from proto.wire.frames import Batch, Replay

REMEMBERED_PUBLISHERS: Final = 1024
"""Publishers whose last sequence number is remembered after they have gone, against duplicates."""


class Known(NamedTuple):
    """The sequence numbers of a publisher that is not attached."""

    received: int
    """The number after the last message that was received or cannot arrive any more."""
    due: int
    """The number of the first message that was for this subscription."""
    missed: int
    """Messages counted as lost that may still arrive."""


class SequenceTracker:
    """The tracker of one subscription.

    Args:
        message_lost: Counts messages that will not arrive.
        latched: Whether the subscription wants messages from before its declaration.

    Attributes:
        attachments: By publisher, its newest attachment; a reconnected publisher may briefly have two.
        known: By publisher, its sequence numbers when it was last detached.
        lost: Messages that never arrived over an unbroken link.
        lost_on_break: Messages that never arrived because a link broke.
    """

    __slots__ = ("_message_lost", "_wants_latched", "attachments", "known", "lost", "lost_on_break")

    def __init__(self, message_lost: Event, *, latched: bool) -> None:
        self.attachments: dict[bytes, Attachment] = {}
        self.known: OrderedDict[bytes, Known] = OrderedDict()
        self.lost = self.lost_on_break = 0
        self._message_lost = message_lost
        self._wants_latched = latched

    def attached(self, attachment: Attachment) -> bool:
        """Begin to track a publisher; a known one continues where it stopped.

        Returns:
            Whether an earlier attachment of the publisher was current until now.
        """
        before = self.attachments.get(attachment.gid)
        if before is not None:
            self._remember(before)
        self.attachments[attachment.gid] = attachment
        attachment.current = True
        known = self.known.get(attachment.gid)
        if known is not None:
            attachment.received = known.received
            attachment.expected = max(known.received, attachment.first_sequence)
            # From a new broker latched messages arrive as live ones: they are for it, too.
            attachment.due = min(known.due, attachment.expected)
            attachment.missed = max(0, attachment.first_sequence - max(known.received, known.due))
            self.lost_on_break += attachment.missed - known.missed
        return before is not None

    def detached(self, attachment: Attachment) -> bool:
        """Remember where a publisher stops; return whether its attachment was current."""
        if not attachment.current:
            return False
        del self.attachments[attachment.gid]
        self._remember(attachment)
        return True

    def session_ended(self) -> None:
        """Remember where every publisher stops."""
        attachments, self.attachments = self.attachments, {}
        for attachment in attachments.values():
            self._remember(attachment)

    def _remember(self, attachment: Attachment) -> None:
        attachment.current = False
        if self._wants_latched:
            known = Known(attachment.received, attachment.due, attachment.missed)
        else:
            self._give_up_missed(attachment, attachment.missed)
            known = Known(attachment.expected, attachment.due, 0)
        self.known[attachment.gid] = known
        # The publishers that left first are forgotten first; one forgotten and back is a new one.
        self.known.move_to_end(attachment.gid)
        while len(self.known) > max(REMEMBERED_PUBLISHERS, len(self.attachments)):
            self.known.popitem(last=False)

    def live(self, attachment: Attachment, batch: Batch) -> int:
        """Count a live batch; return how many of its messages are repetitions."""
        if attachment.missed:
            self._give_up_missed(attachment, attachment.missed)
        # Positive: messages are missing. On an unbroken link the broker or the publisher has dropped them.
        gap = batch.first_sequence - attachment.expected
        if gap > 0:
            self.lost += gap
            self._message_lost.add(gap)
        end = batch.first_sequence + batch.length
        if end > attachment.expected:
            attachment.expected = attachment.received = end
        else:
            attachment.received = attachment.expected
        return -gap if gap < 0 else 0

    def latched(self, attachment: Attachment, replay: Replay) -> int:
        """Count latched messages; return how many of them are repetitions."""
        end = replay.first_sequence + replay.length
        first_new = max(attachment.received, replay.first_sequence)
        # The oldest arrive first: messages missed before them will not arrive.
        older = max(0, min(first_new, attachment.first_sequence) - max(attachment.received, attachment.due))
        self._give_up_missed(attachment, older)
        found = max(0, min(end, attachment.first_sequence) - max(first_new, attachment.due))
        attachment.missed -= found
        self.lost_on_break -= found
        attachment.received = max(attachment.received, end)
        return first_new - replay.first_sequence

    def _give_up_missed(self, attachment: Attachment, count: int) -> None:
        """Count missed messages that no latched ones can replace any more."""
        self._message_lost.add(count)
        attachment.missed -= count
