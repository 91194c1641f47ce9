"""How many messages wait for a reader."""

from __future__ import annotations

from actors.endpoints.subscription.backlog import MessageInfo
from actors.web.topic_feed import MAX_BYTES, NewestMessages, Received

INFO = MessageInfo(0, 0, 0, b"", "/talker")


def test_the_oldest_makes_room() -> None:
    """By number; each call says how many have."""
    queue = NewestMessages(2)
    assert [queue.add(Received(bytes([each]), INFO)) for each in range(4)] == [0, 0, 1, 1]
    assert [each.data for each in queue] == [b"\x02", b"\x03"]


def test_the_newest_is_kept_whatever_its_size() -> None:
    """By size: the others make room for it."""
    queue = NewestMessages(100)
    for _ in range(3):
        queue.add(Received(bytes(1000), INFO))
    assert queue.add(Received(bytes(MAX_BYTES + 1), INFO)) == 3
    assert len(queue) == 1
