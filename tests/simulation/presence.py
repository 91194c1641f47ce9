"""Silence is noticed by the broker and by its nodes within the keepalive limit."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from tests.seams import simulation as seams
from tests.seams.brokers import dispatcher_of
from tests.seams.nodes import link_of
from tests.simulation.network import BROKER

if TYPE_CHECKING:
    from broker.serving.link import Link
    from proto.aio.channel import Channel
    from tests.simulation.member import Member
    from tests.simulation.world import World

NOTICE_SEC: Final = 6.0
"""The keepalive limit of 3 s, twice the time between two checks, and bytes that were still on their way."""


async def silence(
    world: World, lasting: float, *, cannot_send: list[Member], cannot_receive: list[Member]
) -> None:
    """Wait, and check that peers that rely on each other have noticed that they cannot reach each other.

    Args:
        world: The world.
        lasting: Seconds to wait.
        cannot_send: The members whose bytes do not reach the broker.
        cannot_receive: The members that the broker's bytes do not reach.
    """
    theirs = [(member, connection) for member in cannot_send if (connection := _relied_on(world, member))]
    ours = [(member, channel) for member in cannot_receive if (channel := _relying(member))]
    await asyncio.sleep(min(lasting, NOTICE_SEC))
    if lasting > NOTICE_SEC and world.alone:
        for member, connection in theirs:
            if connection.suspended_at is None and _relied_on(world, member) is connection:
                world.complain(f"the broker has not noticed that {member.host} is silent")
        for member, channel in ours:
            if _relying(member) is channel:
                world.complain(f"{member.host} has not noticed that the broker is silent")
    await asyncio.sleep(max(0.0, lasting - NOTICE_SEC))


def _relied_on(world: World, member: Member) -> Link | None:
    """Return the broker's end of a member's link, if somebody is matched with the member."""
    broker = world.home.broker
    assert broker is not None
    for router, joined in dispatcher_of(broker).joined.items():
        holders = seams.holders_of(router, member.node.get_fully_qualified_name())
        record = next(iter(holders.values()), None)
        connection = None if record is None else joined.get(record.peer.id)
        if record is not None and connection is not None and connection.channel.connected:
            return connection if record.peer.matched or record.peer.suspended else None
    return None


def _relying(member: Member) -> Channel | None:
    """Return a member's end of its link to the first broker, if it is matched with somebody."""
    link = link_of(member.node)
    channel = link.channel
    if channel is None or not link.matched:
        return None
    return channel if seams.peer_address(channel) == BROKER else None
