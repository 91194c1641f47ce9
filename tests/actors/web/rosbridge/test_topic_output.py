"""What a client gets of a topic, and when."""

from __future__ import annotations

from typing import Any

import pytest

from actors.web.rosbridge.operations import Subscribe
from actors.web.rosbridge.topic_output import MAX_QUEUE, MAX_SUBSCRIPTIONS, MAX_WAITING, TopicOutput


def _output(**wishes: Any) -> TopicOutput[int]:
    output = TopicOutput[int]()
    output.subscribe(Subscribe(topic="a", **wishes))
    return output


def test_a_throttle_sends_the_newest_when_its_time_has_come() -> None:
    """The first at once; without a queue one message waits."""
    output = _output(throttle_rate=100)
    output.add(1)
    assert output.pop(10.0) == 1
    for message in (2, 3):
        output.add(message)
    assert (output.waiting, output.next_sec) == (1, 10.1)
    assert output.pop(10.05) is None
    assert output.pop(10.1) == 3
    assert output.pop(11) is None


def test_a_queue_keeps_messages_for_the_throttle() -> None:
    """As many as the client wants, the newest, up to a limit."""
    output = _output(throttle_rate=100, queue_length=2)
    for message in (1, 2, 3):
        output.add(message)
    assert [output.pop(time) for time in (0.0, 0.05, 0.1, 0.2)] == [2, None, 3, None]
    output = _output(throttle_rate=100, queue_length=10**6)
    for message in range(MAX_QUEUE + 1):
        output.add(message)
    assert output.waiting == MAX_QUEUE


@pytest.mark.parametrize(
    ("throttle", "length", "limit"),
    [(0, 0, MAX_WAITING), (0, 1, 1), (0, 10**6, MAX_WAITING), (1, 1, MAX_WAITING)],
)
def test_a_queue_without_a_throttle_is_for_a_slow_client(throttle: int, length: int, limit: int) -> None:
    """With a throttle it is not."""
    assert _output(throttle_rate=throttle, queue_length=length).limit == limit


@pytest.mark.parametrize(
    ("compressions", "expected"),
    [
        (("none", None), "none"),
        (("none", "png"), "png"),
        (("cbor", "png"), "cbor"),
        (("cbor", "cbor-raw", "none"), "cbor-raw"),
    ],
)
def test_several_subscriptions_are_served_by_one(compressions: tuple[Any, ...], expected: str) -> None:
    """The shortest throttle, the longest queue, the smallest fragments, the densest compression."""
    output = TopicOutput[int]()
    for number, each in enumerate(compressions):
        output.subscribe(
            Subscribe(
                id=number, topic="a", throttle_rate=100 + number, queue_length=number,
                fragment_size=10 * number or None, compression=each,
            )
        )  # fmt: skip
    last = len(compressions) - 1
    assert (output.throttle_sec, output.queue_length, output.fragment_size) == (0.1, last, 10)
    assert output.compression == expected


def test_subscriptions_end_by_id_or_all_at_once() -> None:
    """One of the same id replaces the one before."""
    output = _output(id="a", throttle_rate=100)
    output.subscribe(Subscribe(id="a", topic="a"))
    assert output.throttle_sec == 0
    output.subscribe(Subscribe(id="b", topic="a"))
    assert not output.unsubscribe("c")
    assert output.unsubscribe("a")
    assert output
    assert output.unsubscribe(None)
    assert not output
    assert not output.unsubscribe(None)


def test_subscriptions_are_limited() -> None:
    """A client may make each with another id."""
    output = TopicOutput[int]()
    for number in range(MAX_SUBSCRIPTIONS):
        assert not output.is_full
        output.subscribe(Subscribe(id=number, topic="a"))
    assert output.is_full
