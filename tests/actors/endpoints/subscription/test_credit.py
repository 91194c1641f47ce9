"""Grants: at the attachment, when half is taken, and to nobody while leftovers wait."""

from __future__ import annotations

from typing import Any

from actors.endpoints.subscription.backlog import QueuedBatch
from actors.endpoints.subscription.credit import SHARED_MESSAGES, WINDOW_MESSAGES, SubscriptionCredit
from actors.endpoints.subscription.sequence_tracker import SequenceTracker
from actors.session.attachments import Attachment
from proto.wire.frames import Attached, Batch


class Nobody:
    """A reader, and an event, that are not looked at."""

    def add(self, count: int) -> None:
        """Count nothing."""


class Bench:
    """A sequence tracker, its credit, and the sequence limits that have been sent."""

    def __init__(self) -> None:
        nobody: Any = Nobody()
        self.sent: list[tuple[int, int]] = []
        self.tracker = SequenceTracker(nobody, latched=False)
        self.credit = SubscriptionCredit(self.tracker, self._send)

    def _send(self, attachment: Attachment) -> None:
        self.sent.append((attachment.publisher, attachment.granted_sequence))

    def attach(self, publisher: int) -> Attachment:
        """Let a publisher come."""
        nobody: Any = Nobody()
        gid = bytes([publisher]) * 16
        attachment = Attachment(nobody, Attached(publisher, (1,), gid, 0, "/talker", {}))
        self.tracker.attached(attachment)
        self.credit.attached(attachment)
        return attachment

    def detach(self, attachment: Attachment, newest: QueuedBatch | None) -> None:
        """Let a publisher go, while something waits, or nothing."""
        self.tracker.detached(attachment)
        self.credit.detached(newest)


def queued_batch(attachment: Attachment, end: int) -> QueuedBatch:
    """Return what waits of a publisher, up to a number."""
    batch = Batch(attachment.publisher, 0, 0, end, None, None, b"", b"")
    made = QueuedBatch(attachment, batch, [None] * end, range(end), 0)
    made.end, made.size = end, 10 * end
    return made


def test_a_publisher_is_granted_a_window_when_it_comes_and_another_when_half_is_taken() -> None:
    """So a grant is sent for each half of a window."""
    bench = Bench()
    attachment = bench.attach(1)
    assert bench.sent == [(1, WINDOW_MESSAGES)]
    assert bench.credit.limit == WINDOW_MESSAGES
    half = WINDOW_MESSAGES // 2
    bench.credit.consumed(attachment, half, 10)
    assert len(bench.sent) == 1
    bench.credit.consumed(attachment, half + 1, 10)
    assert bench.sent[1:] == [(1, half + 1 + WINDOW_MESSAGES)]


def test_while_leftovers_wait_nobody_is_granted_anything() -> None:
    """Not at the attachment, nor for what is taken; when the leftovers are, everybody gets a window."""
    bench = Bench()
    old, active = bench.attach(1), bench.attach(2)
    used, leftover = queued_batch(active, 20_000), queued_batch(old, 3)
    bench.detach(old, leftover)
    bench.sent.clear()
    bench.attach(3)
    bench.attach(4)
    bench.credit.finished(used)
    bench.credit.consumed(active, 20_001, 10)
    assert bench.sent == []
    bench.credit.finished(leftover)
    window = SHARED_MESSAGES // 3
    assert bench.sent == [(2, 20_001 + window), (3, window), (4, window)]


def test_when_publishers_have_gone_the_windows_of_the_others_are_larger() -> None:
    """What they share is shared anew by those that are still there."""
    bench = Bench()
    stays, *go = [bench.attach(publisher) for publisher in (1, 2, 3, 4)]
    for attachment in go:
        bench.detach(attachment, None)
    assert bench.credit.limit == WINDOW_MESSAGES
    bench.sent.clear()
    bench.credit.consumed(stays, WINDOW_MESSAGES, 10)
    assert bench.sent == [(1, 2 * WINDOW_MESSAGES)]


def test_what_is_taken_of_a_publisher_that_has_gone_grants_nothing() -> None:
    """Its number may be another's in the next session."""
    bench = Bench()
    attachment = bench.attach(1)
    bench.detach(attachment, None)
    bench.sent.clear()
    bench.credit.consumed(attachment, 10 * WINDOW_MESSAGES, 10)
    assert bench.sent == []
