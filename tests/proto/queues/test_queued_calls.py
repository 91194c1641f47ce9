"""Shares of the requests that wait for one server's link."""

from __future__ import annotations

from proto.limits import FRAME_OVERHEAD_BYTES
from proto.queues.outbox import Outbox
from proto.queues.queued_calls import QueuedCalls
from tests.proto.outboxes import drain, request
from tests.seams.protocol import kept_shares


def test_a_share_counts_requests_until_they_are_sent_or_dropped() -> None:
    """Small and large requests count in their share and do not count against the server's link."""
    queued, outbox = QueuedCalls(1000, 2**30), Outbox()
    share = queued.share(1)
    for call, size in enumerate((1, 2, 300, 300)):
        raw = request(call, size * 1024)
        share.add(raw)
        outbox.put_calls(raw, (1, call), share)
        assert (outbox.undroppable_bytes, outbox.bulk_bytes) == (0, 0)
        assert share.bytes == queued.bytes == outbox.urgent_bytes
    outbox.drop_call((1, 3))
    assert share.bytes == queued.bytes == outbox.urgent_bytes > 300 * 1024
    drain(outbox)
    assert share.bytes == queued.bytes == outbox.urgent_bytes == 0


def test_a_share_leaves_space_for_others() -> None:
    """A share takes what is free, up to its limit; one larger frame takes half of it if nothing waits."""
    queued = QueuedCalls(1000, 4000)
    frame = bytes(1000 - FRAME_OVERHEAD_BYTES)
    first, second, third = (queued.share(client) for client in range(3))
    assert QueuedCalls(1000, 4000).share(1).admit(bytes(5000))  # alone
    assert first.admit(frame)
    assert not first.admit(b"x")
    assert not second.admit(bytes(1600))
    assert second.admit(bytes(1400))
    second.add(bytes(1100 - FRAME_OVERHEAD_BYTES))
    assert not third.admit(frame)
    assert third.admit(bytes(300))
    second.remove(2500 + FRAME_OVERHEAD_BYTES)
    assert queued.share(1).admit(frame)
    assert queued.bytes == sum(share.bytes for share in (first, second, third))


def test_empty_shares_are_forgotten() -> None:
    """Clients that come and go leave nothing behind; a share in use stays the same."""
    queued = QueuedCalls(1000, 4000)
    kept = queued.share(0)
    kept.add(b"x")
    for client in range(1, 1000):
        queued.share(client)
    assert queued.share(0) is kept
    assert kept_shares(queued) < 100
