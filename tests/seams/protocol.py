"""What tests read or set inside queues, channels and transports, where no public name has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from proto.wire.session import Session

if TYPE_CHECKING:
    import asyncio
    from collections import deque
    from collections.abc import Iterable

    from proto.aio.channel import Channel
    from proto.aio.tls_transport import TlsTransport
    from proto.loop_lag import LoopLag
    from proto.queues.publisher_queue import PublisherQueue
    from proto.queues.queued_calls import QueuedCalls
    from proto.wire.session import Role, State


def enter(session: Session, state: State) -> None:
    """Put a session into a state, without the frames that lead there."""
    session._enter(state)


def session_in(role: Role, state: State) -> Session:
    """Return a session in a state."""
    session = Session(role)
    session._enter(state)
    return session


def is_lingering(channel: Channel) -> bool:
    """Return whether a channel has limited the time for its last bytes; else a test would wait for it."""
    return channel._linger is not None


def handler_of(channel: Channel) -> Any:
    """Return what handles a channel's frames."""
    return channel._handler


def waiting_items(queue: PublisherQueue) -> Iterable[Any]:
    """Return the items that a queue has not begun to send: only it knows how it has split a batch."""
    return queue._queue


def replace_items(queue: PublisherQueue, kind: type[deque[Any]]) -> Any:
    """Put a queue's items into a deque that counts, and return it."""
    queue._queue = kind(queue._queue)
    return queue._queue


def kept_shares(queued: QueuedCalls) -> int:
    """Return how many clients' shares are kept: one that is empty weighs nothing, but uses memory."""
    return len(queued._shares)


def kept_maxima(lag: LoopLag) -> int:
    """Return how many numbers are kept of the last minute."""
    return len(lag._buckets)


def encrypt_apart(transport: TlsTransport, data: bytes) -> bytes:
    """Return data as a TLS record for each byte, as a peer may send it and no transport of ours does."""
    records: list[bytes] = []
    for byte in data:
        transport._cipher.encrypt(bytes((byte,)))
        records.append(transport._cipher.pop_output())
    return b"".join(records)


def raw_transport(transport: TlsTransport) -> asyncio.Transport:
    """Return the socket's transport under TLS, to put bytes into the stream that are no records of it."""
    assert transport._raw is not None
    return transport._raw
