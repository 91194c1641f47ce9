"""Attacks on others' identities: no link can take over a publisher's numbers or a node's name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.message import type_hash, type_name
from actors.interfaces.std_msgs.msg import Int64
from broker import Broker, BrokerOptions
from proto.wire import frames
from proto.wire.identity import public_gid
from tests.actors.meeting import until
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, link
from tests.broker.switch import Switch
from tests.ports import held_port

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.usefixtures("patience")

HUGE = 2**60


async def overtake(thief: RawClient, gid: bytes, heard: Callable[[], int]) -> None:
    """Publish a message with a huge number on /numbers under a gid, and wait until it has arrived."""
    declaration = frames.Publisher(
        2, 0, "/numbers", type_name(Int64), type_hash(Int64), {}, gid, HUGE, None, HUGE
    )
    before = heard()
    thief.send(declaration)
    number = (await thief.next(frames.Accepted)).number
    thief.send(make.batch(number, HUGE))
    await until(lambda: heard() > before)


async def test_a_publisher_with_the_gid_of_another_silences_nobody() -> None:
    """Case 45: subscribers keep apart who copies a gid from ATTACHED, also after a restart of the broker."""
    heard: list[int] = []
    with held_port() as port:
        options = BrokerOptions(port=port, drain_timeout_sec=0.2)
        async with Broker(options) as broker:
            talker, listener = actors.Node("talker", url=broker.url), actors.Node("listener", url=broker.url)
            async with talker, listener:
                publisher = talker.create_publisher(Int64, "numbers")
                subscription = listener.create_subscription(
                    Int64, "numbers", lambda msg: heard.append(msg.data)
                )

                def arrived() -> int:
                    return len(heard) + subscription.undecodable

                await until(publisher.get_subscription_count)
                publisher.publish(Int64(data=1))
                await until(lambda: heard == [1])
                async with link(broker, "/thief") as thief:
                    thief.send(make.subscription(1, "/numbers", raw=True))
                    gid = (await thief.next(frames.Attached)).gid
                    assert gid == publisher.gid
                    await overtake(thief, gid, arrived)
                publisher.publish(Int64(data=2))
                await until(lambda: heard == [1, 2])
                await broker.stop()
                async with Broker(options) as restarted:
                    await until(publisher.get_subscription_count)
                    async with link(restarted, "/thief") as thief:
                        await overtake(thief, gid, arrived)
                    publisher.publish(Int64(data=3))
                    await until(lambda: heard == [1, 2, 3])
                assert publisher.gid == gid


def test_a_publisher_with_the_gid_of_another_resumes_none_of_its_queues() -> None:
    """Case 45: a queue that a publisher left goes to the same client only, whose token nobody knows."""
    switch = Switch()
    talker = switch.join("/talker", token=b"1" * 16)
    listener = switch.join("/listener", token=b"2" * 16)
    thief = switch.join("/thief", token=b"3" * 16)
    switch.send(listener, make.subscription(1))
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, make.batch(number, 0, 5))
    switch.leave(talker)
    stolen = switch.publisher(thief, make.publisher(1, next_sequence=HUGE))
    switch.send(thief, make.batch(stolen, HUGE))
    read = switch.read_all(listener)
    assert [(frame.publisher, frame.first_sequence) for frame in read if isinstance(frame, frames.Batch)] == [
        (number, 0),
        (stolen, HUGE),
    ]
    gids = [frame.gid for frame in read if isinstance(frame, frames.Attached)]
    assert gids == [public_gid(b"1" * 16, make.GID), public_gid(b"3" * 16, make.GID)]
