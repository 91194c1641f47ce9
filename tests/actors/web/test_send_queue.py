"""What waits for a slow client."""

from __future__ import annotations

from actors.web import send_queue
from actors.web.send_queue import MAX_CHANNEL_BYTES, MAX_CLIENT_BYTES, MAX_LATCHED_BYTES, SendQueue


def drained(queue: SendQueue[str, object]) -> list[tuple[str, object]]:
    found = []
    while queue:
        found.append(queue.pop())
    return found


def queue_of(*keys: str) -> SendQueue[str, object]:
    queue = SendQueue[str, object]()
    for key in keys:
        queue.open(key)
    return queue


def test_channels_take_turns() -> None:
    """A flood on one channel does not delay the only message of another."""
    queue = queue_of("flood", "rare")
    for number in range(3):
        queue.add("flood", number, 1)
    queue.add("rare", "once", 1)
    assert drained(queue) == [("flood", 0), ("rare", "once"), ("flood", 1), ("flood", 2)]


def test_a_full_channel_drops_its_oldest() -> None:
    """Beyond its number of messages; the drops are counted for the channel."""
    queue = SendQueue[str, object]()
    queue.open("a", limit=2)
    queue.open("b")
    for number in range(5):
        queue.add("a", number, 1)
    assert drained(queue) == [("a", 3), ("a", 4)]
    assert queue.drops == {"a": 3}


def test_a_large_message_replaces_the_one_before() -> None:
    """The newest waits, whatever its size; never two that are too large."""
    queue = queue_of("image")
    for number in range(3):
        queue.add("image", number, 2 * MAX_CHANNEL_BYTES)
    assert drained(queue) == [("image", 2)]
    assert queue.droppable == 0


def test_the_newest_of_each_publisher_of_a_latched_topic_stays() -> None:
    """Whatever else is published on the topic, and on others."""
    queue = queue_of("tf_static", "flood")
    for source in (b"arm", b"base"):
        queue.add("tf_static", f"{source.decode()} old", 1, source)
        queue.add("tf_static", source.decode(), 1, source)
    for number in range(2000):
        queue.add("tf_static", number, 1, b"noise")
        queue.add("flood", number, MAX_CHANNEL_BYTES // 10)
    taken = drained(queue)
    latched = [message for key, message in taken if key == "tf_static"]
    assert latched[:2] == ["arm", "base"]
    assert latched[-1] == 1999
    assert len(latched) <= send_queue.MAX_MESSAGES
    assert queue.drops.total() == 4004 - len(taken)


def test_latched_messages_have_a_limit_of_their_own() -> None:
    """Publishers in any number cannot fill the memory with them; the newest stays."""
    queue = queue_of("map")
    for number in range(20):
        queue.add("map", number, MAX_LATCHED_BYTES // 8, number.to_bytes())
    assert [message for _, message in drained(queue)] == [13, 14, 15, 16, 17, 18, 19]
    queue = queue_of("map")
    for number in range(2000):
        queue.add("map", number, 1, number.to_bytes(2))
    assert len(drained(queue)) == send_queue.MAX_MESSAGES


def test_many_channels_together_have_a_limit() -> None:
    """Then the largest lose most, and each keeps its newest as long as that is possible."""
    keys = [str(number) for number in range(200)]
    queue = queue_of(*keys, "small")
    queue.add("small", "only", 10)
    for number in range(20):
        for key in keys:
            queue.add(key, number, MAX_CHANNEL_BYTES // 10)
    assert queue.droppable <= MAX_CLIENT_BYTES
    taken = drained(queue)
    assert dict(taken) == {**dict.fromkeys(keys, 19), "small": "only"}
    assert queue.drops.total() == 200 * 20 + 1 - len(taken)


def test_newest_messages_that_are_too_many_are_dropped() -> None:
    """Channels with one large message each: what has just come is not among the dropped."""
    keys = [str(number) for number in range(100)]
    queue = queue_of(*keys)
    for key in keys:
        queue.add(key, key, MAX_CHANNEL_BYTES)
        assert queue.droppable <= MAX_CLIENT_BYTES
    taken = [key for key, _ in drained(queue)]
    assert taken[-1] == "99"
    assert len(taken) + queue.drops.total() == 100
    assert queue.droppable == 0


def test_a_closed_channel_has_no_messages() -> None:
    """Nor do its drops and bytes count."""
    queue = queue_of("a", "b")
    queue.add("a", 1, 1000)
    queue.add("b", 2, 1, b"x")
    queue.close("a")
    assert drained(queue) == [("b", 2)]
    assert queue.droppable == 0
    queue.open("a")
    queue.add("a", 3, 1)
    assert drained(queue) == [("a", 3)]
