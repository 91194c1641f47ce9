"""A broker's part in a mesh, with an engine that records what it is asked to do."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from broker import AddressInUseError, Broker, BrokerOptions
from broker.mesh import member
from broker.mesh.engine import EngineStats
from broker.mesh.messages import Direct

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
        self.pinged = asyncio.Event()

    async def start(self) -> None:
        """Engine."""
        self.running = True

    def join(self, domain: int) -> None:
        """Engine."""

    def send(self, domain: int, messages: list[Message]) -> None:
        """Engine."""
        if any(isinstance(each, Direct) for each in messages):
            self.pinged.set()

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


async def stop_with_another(monkeypatch: pytest.MonkeyPatch) -> tuple[RecordingEngine, asyncio.Task[None]]:
    """Return an engine, and the stop of its broker, which waits for another broker's answer."""
    monkeypatch.setattr(member, "LAST_ANSWER_SEC", 3600.0)
    engines: list[RecordingEngine] = []

    def make_engine(number: int, host: Host) -> RecordingEngine:
        engines.append(RecordingEngine(number, host))
        return engines[-1]

    broker = await Broker(BrokerOptions(port=0), mesh_engine=make_engine).__aenter__()
    (engine,) = engines
    engine.host.mesh(0).add_broker(1 + engine.number % 2)
    stopping = asyncio.create_task(broker.stop())
    await asyncio.wait_for(engine.pinged.wait(), 10)
    await asyncio.wait({stopping}, timeout=0)
    assert engine.running
    return engine, stopping


async def test_a_stop_does_not_wait_for_a_broker_that_has_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two brokers that stop at the same time may not answer each other."""
    engine, stopping = await stop_with_another(monkeypatch)
    engine.host.mesh(0).remove_broker(1 + engine.number % 2)
    engine.host.flush()
    await asyncio.wait_for(stopping, 10)
    assert not engine.running


async def test_a_cancelled_stop_closes_the_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its session may not be open when the interpreter exits."""
    engine, stopping = await stop_with_another(monkeypatch)
    stopping.cancel()
    await asyncio.wait({stopping}, timeout=10)
    assert not engine.running
