"""Shared memory: another user gets nothing of it, and nobody makes the broker map more than its limits."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from proto import frames
from proto.aio.arena import host_identity
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link
from tests.broker.test_shared_memory import Sender

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

HOST = host_identity()


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


@pytest.mark.parametrize("sent", [(), (frames.Proof(bytes(16)),)], ids=["no proof", "wrong proof"])
async def test_a_host_identity_alone_opens_nothing(broker: Broker, sent: tuple[frames.Frame, ...]) -> None:
    """It is no secret: a thief learns of no arena, and the broker opens none for it."""
    async with link(broker, "/victim", host=HOST) as victim, RawClient().connected(broker) as thief:
        source = Sender(victim)
        await source.declare()
        thief.send(hello(host=HOST))
        await thief.next(frames.Welcome)
        thief.send(*sent, frames.Node(0, "/thief"), make.subscription(1))
        await thief.next(frames.Accepted)
        victim.send(source.reference(), source.reference())
        await source.release(0, 1)
        await thief.next(frames.Batch)
        await thief.synchronise()
        assert not thief.waiting(frames.Arena)
        thief.send(source.arena.announcement)
        assert "not proved" in (await thief.next(frames.Mapped)).problem


async def test_nobody_uses_the_arena_of_another_link(broker: Broker) -> None:
    """A reader that sends back what was announced to it gets nothing."""
    async with link(broker, "/victim", host=HOST) as victim, link(broker, "/thief", host=HOST) as thief:
        source = Sender(victim)
        await source.declare()
        thief.send(source.arena.announcement)
        assert "another link" in (await thief.next(frames.Mapped)).problem
