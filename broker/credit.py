"""Credit: how far the slowest KEEP_ALL subscription lets each publisher go (docs/protocol.md §6.5)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.deliveries import Send
from proto.batches import message_bytes
from proto.codec import ends_from_bytes
from proto.errors import ErrorCode, ProtocolError
from proto.frames import Batch, Credit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from broker.deliveries import Delivery
    from broker.records import PublisherRecord, SubscriptionRecord


HELD: Final = 0
"""Stands for no subscription: their keys begin at 1."""


def allow(publisher: PublisherRecord, subscription: SubscriptionRecord) -> None:
    """A KEEP_ALL subscription has been attached: it starts with its windows."""
    publisher.credits.add(
        subscription.key,
        publisher.first_for(subscription) + subscription.window_messages,
        subscription.window_bytes,
        publisher.bytes,
    )


def hold(publisher: PublisherRecord) -> None:
    """Nothing more may be sent than has been: an allowance beside those of its subscriptions."""
    publisher.credits.add(HELD, publisher.next_sequence, 0, publisher.bytes)


def update(publisher: PublisherRecord) -> Iterator[Delivery]:
    """Tell the publisher when the least of its subscriptions' credit has changed."""
    limit = publisher.credits.least()
    if limit == publisher.limit:
        return
    publisher.limit = limit
    if limit is None:
        publisher.promised = None
        yield Send(publisher.peer.id, Credit(publisher.key, None, None))
        return
    if publisher.promised is None:
        publisher.echoes_owed += 1
    sequence, size = publisher.promised or limit
    publisher.promised = max(sequence, limit[0]), max(size, limit[1])
    yield Send(publisher.peer.id, Credit(publisher.key, *limit))


def confirmed(publisher: PublisherRecord) -> None:
    """The publisher knows of a limit; when it knows of the latest, it is held to it."""
    if publisher.echoes_owed:
        publisher.echoes_owed -= 1


def check(publisher: PublisherRecord, batch: Batch) -> None:
    """Hold a publisher to what it was promised.

    A message may be sent while the number after the last one sent is below the sequence limit, so numbers
    that the publisher dropped do not use credit up, and while the bytes sent before it are below the byte
    limit.

    Raises:
        ProtocolError: The run goes beyond.
    """
    if publisher.echoes_owed or publisher.promised is None:
        return
    sequence_limit, byte_limit = publisher.promised
    number = publisher.next_sequence
    before = publisher.bytes
    if batch.ends is not None:
        number = batch.first_sequence + batch.length - 1
        before += ends_from_bytes(batch.ends[-8:-4])[0] if len(batch.ends) >= 8 else 0
    if number >= sequence_limit or before >= byte_limit:
        text = (
            f"publisher on '{publisher.name}' went beyond its credit: message {number} of {sequence_limit},"
            f" byte {publisher.bytes + message_bytes(batch)} of {byte_limit}"
        )
        raise ProtocolError(ErrorCode.CREDIT, text)
