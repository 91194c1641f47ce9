"""`publish_encoded`: bytes are sent as `publish` sends messages, but are not decoded first."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.std_msgs.msg import Int64, UInt8MultiArray
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, latched, matched, until
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting


def encoded(number: int) -> bytes:
    return codec_for(Int64).encode(Int64(data=number))


async def test_a_batch_arrives_in_order(meeting: Meeting) -> None:
    """Mixed with `publish`, from bytes, a bytearray that changes afterwards, and a view."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    got: list[int] = []
    node.create_subscription(Int64, "number", lambda message: got.append(message.data))
    await matched(publisher)
    changing = bytearray(encoded(3))
    publisher.publish_encoded(encoded(1))
    publisher.publish(Int64(data=2))
    publisher.publish_encoded(changing)
    changing[:] = bytes(len(changing))
    publisher.publish_encoded(memoryview(encoded(4)))
    await until(lambda: got == [1, 2, 3, 4])
    assert publisher.published == 4


async def test_a_large_message_arrives(meeting: Meeting) -> None:
    """An encoded message that travels in fragments arrives whole."""
    node = await meeting.node("node")
    publisher = node.create_publisher(UInt8MultiArray, "blob")
    got: list[bytes] = []
    node.create_subscription(UInt8MultiArray, "blob", lambda message: got.append(bytes(message.data)))
    await matched(publisher)
    data = bytes(range(256)) * 4096
    publisher.publish_encoded(codec_for(UInt8MultiArray).encode(UInt8MultiArray(data=data)))
    await until(lambda: got == [data])


async def test_a_latched_message_reaches_late_joiners(meeting: Meeting) -> None:
    """Encoded messages of a TRANSIENT_LOCAL publisher are latched, as those of `publish`."""
    node = await meeting.node("node")
    node.create_publisher(Int64, "number", latched(1)).publish_encoded(encoded(7))
    message = await actors.wait_for_message(Int64, node, "number", DEADLINE_SEC, qos_profile=latched(1))
    assert message.data == 7


async def test_keep_all_is_full_at_its_limit(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """PublisherFull, as with `publish`; nothing is lost."""
    set_limits(monkeypatch, keep_all_messages=3)
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number", KEEP_ALL)
    subscription = node.create_subscription(Int64, "number", qos_profile=KEEP_ALL)
    await matched(publisher)
    for number in range(3):
        publisher.publish_encoded(encoded(number))
    with pytest.raises(actors.PublisherFull):
        publisher.publish_encoded(encoded(3))
    async with asyncio.timeout(DEADLINE_SEC):
        assert [(await anext(aiter(subscription))).data for _ in range(3)] == [0, 1, 2]


async def test_bytes_are_not_decoded(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes of another type leave; the subscription counts them and keeps the others of the batch."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    subscription = node.create_subscription(Int64, "number", qos_profile=10)
    await matched(publisher)

    def refuse(codec: Codec[Any], data: bytes) -> None:
        raise AssertionError(f"decoded {data!r}")

    with monkeypatch.context() as patch:
        patch.setattr(Codec, "decode", refuse)
        publisher.publish_encoded(encoded(1))
        publisher.publish_encoded(b"\x81\xa4data\xa1x")
        publisher.publish_encoded(encoded(2))
    await until(lambda: subscription.queued == 2)
    assert subscription.undecodable == 1


@pytest.mark.parametrize("data", [b"", b"\x00\x01\x00\x00", b"\xa1x"])
async def test_bytes_that_are_no_map_are_refused(meeting: Meeting, data: bytes) -> None:
    """Such as an empty message, CDR, or a string: nothing is sent."""
    node = await meeting.node("node")
    publisher = node.create_publisher(Int64, "number")
    with pytest.raises(InvalidMessageError, match="begins with a msgpack map"):
        publisher.publish_encoded(data)
    with pytest.raises(TypeError):
        publisher.publish_encoded("text")  # type: ignore[arg-type]
    assert publisher.published == 0


async def test_a_message_over_the_brokers_limit_is_refused(meeting: Meeting) -> None:
    """InvalidMessageError, as with `publish`, and the link stays."""
    await meeting.restart_broker(max_message_bytes=1024 * 1024)
    node = await meeting.node("node")
    publisher = node.create_publisher(UInt8MultiArray, "blob")
    data = codec_for(UInt8MultiArray).encode(UInt8MultiArray(data=bytes(2 * 1024 * 1024)))
    with pytest.raises(InvalidMessageError, match="over the limit of"):
        publisher.publish_encoded(data)
    assert node.connected
