"""Latched messages: those of TRANSIENT_LOCAL publishers, kept for late joiners (docs/protocol.md §6.6)."""

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
"""Messages kept of a KEEP_ALL + TRANSIENT_LOCAL publisher."""

LATCHED_BYTES: Final = 64 * 1024 * 1024
"""Bytes kept of one publisher; beyond it the oldest messages are dropped, whatever the depth."""

LATCHED_BYTES_PER_LINK: Final = 256 * 1024 * 1024
"""Bytes kept of all publishers of one link; beyond it the one that publishes loses its oldest messages."""


def latched_depth(qos: Qos) -> int:
    """Return how many messages of a publisher with this QoS are kept."""
    if not qos.latched:
        return 0
    return LATCHED_MESSAGES if qos.history == KEEP_ALL else qos.depth


def latch(publisher: PublisherRecord, batch: Batch) -> int:
    """Keep a batch; drop the oldest messages beyond the limits.

    Returns:
        How many messages late joiners will miss: those within the depth but beyond a limit in bytes.
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
    """Drop messages of the oldest batch, at most `most`; return how many."""
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
    """Drop all messages of a publisher that is gone for good."""
    _count(publisher, -publisher.latched_bytes)
    publisher.latched_messages = 0
    publisher.latched.clear()


def _count(publisher: PublisherRecord, size: int) -> None:
    publisher.latched_bytes += size
    publisher.peer.latched_bytes += size


def replays(publisher: PublisherRecord, subscription: SubscriptionRecord) -> Iterator[frames.Replay]:
    """Return the latched messages for a late joiner, up to its depth."""
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
