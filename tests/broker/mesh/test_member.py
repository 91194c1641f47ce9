"""A broker's part in a mesh, with an engine that records what it is asked to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from broker import AddressInUseError, Broker, BrokerOptions
from broker.mesh.engine import EngineStats

if TYPE_CHECKING:
    from broker.mesh.engine import Host
    from broker.mesh.messages import Message


class RecordingEngine:
    """An engine without other brokers (`engine.Engine`)."""

    full = False

    def __init__(self, number: int, host: Host) -> None:
        self.number = number
        self.host = host
        self.running = False

    async def start(self) -> None:
        """Engine."""
        self.running = True

    def join(self, domain: int) -> None:
        """Engine."""

    def send(self, domain: int, messages: list[Message]) -> None:
        """Engine."""

    def statistics(self) -> EngineStats:
        """Engine."""
        return EngineStats({})

    async def stop(self) -> None:
        """Engine."""
        self.running = False


async def test_a_broker_that_cannot_listen_leaves_the_mesh() -> None:
    """Its engine is stopped, so that others do not see it."""
    engines: list[RecordingEngine] = []

    def make_engine(number: int, host: Host) -> RecordingEngine:
        engines.append(RecordingEngine(number, host))
        return engines[-1]

    async with Broker(BrokerOptions(port=0), mesh_engine=make_engine) as first:
        assert engines[0].running
        port = int(first.url.rpartition(":")[2])
        with pytest.raises(AddressInUseError):
            await Broker(BrokerOptions(port=port), mesh_engine=make_engine).__aenter__()
        assert [each.running for each in engines] == [True, False]
    assert not engines[0].running
