"""Latched messages: what a TRANSIENT_LOCAL publisher's late joiners get (docs/protocol.md §6.6)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto import frames
from proto.batches import message_bytes, slice_batch
from proto.qos import KEEP_ALL, Qos

if TYPE_CHECKING:
    from collections.abc import Iterator

    from broker.records import PublisherRecord, SubscriptionRecord
    from proto.frames import Batch

LATCHED_MESSAGES: Final = 1000
"""What is kept for late joiners of a KEEP_ALL + TRANSIENT_LOCAL publisher."""

LATCHED_BYTES: Final = 64 * 1024 * 1024
"""What is kept for late joiners of one publisher: beyond it the oldest go, whatever the depth."""

LATCHED_BYTES_PER_LINK: Final = 256 * 1024 * 1024
"""The same for all publishers of one link: beyond it the oldest go of whoever publishes."""


def latched_depth(qos: Qos) -> int:
    """Return how many messages of a publisher are kept for late joiners."""
    if not qos.latched:
        return 0
    return LATCHED_MESSAGES if qos.history == KEEP_ALL else qos.depth


def latch(publisher: PublisherRecord, batch: Batch) -> int:
    """Keep a run; the oldest messages go beyond the limits.

    Returns:
        How many late joiners will miss: those that the depth had room for, and a limit in bytes had not.
    """
    keep = publisher.keep
    publisher.latched.append(batch)
    publisher.latched_messages += batch.length
    _count(publisher, message_bytes(batch))
    while publisher.latched_messages > keep:
        _unlatch_oldest(publisher, publisher.latched_messages - keep)
    missed = 0
    while publisher.latched and (
        publisher.latched_bytes > LATCHED_BYTES or publisher.peer.latched_bytes > LATCHED_BYTES_PER_LINK
    ):
        missed += _unlatch_oldest(publisher, publisher.latched_messages)
    return missed


def _unlatch_oldest(publisher: PublisherRecord, most: int) -> int:
    """Forget the oldest run, but no more than so many messages; return how many."""
    oldest = publisher.latched.popleft()
    gone = min(oldest.length, most)
    publisher.latched_messages -= gone
    _count(publisher, -message_bytes(oldest))
    if gone < oldest.length:
        rest = slice_batch(oldest, gone, oldest.length)
        publisher.latched.appendleft(rest)
        _count(publisher, message_bytes(rest))
    return gone


def unlatch(publisher: PublisherRecord) -> None:
    """Forget everything: the publisher has gone for good."""
    _count(publisher, -publisher.latched_bytes)
    publisher.latched_messages = 0
    publisher.latched.clear()


def _count(publisher: PublisherRecord, size: int) -> None:
    publisher.latched_bytes += size
    publisher.peer.latched_bytes += size


def replays(publisher: PublisherRecord, subscription: SubscriptionRecord) -> Iterator[frames.Replay]:
    """Return what a late joiner would have if it had been there, to its depth."""
    skip = 0
    if subscription.depth is not None:
        skip = max(0, publisher.latched_messages - subscription.depth)
    for batch in publisher.latched:
        if skip >= batch.length:
            skip -= batch.length
            continue
        kept = slice_batch(batch, skip, batch.length)
        skip = 0
        yield frames.Replay(subscription.id, *kept[:-1])
