"""How a broker joins a mesh and leaves it, and what it logs about the others."""

from __future__ import annotations

import asyncio
from itertools import count
from typing import TYPE_CHECKING, Any
from unittest import mock

from broker.mesh import slices
from broker.mesh.engine.engine import EngineStats
from broker.mesh.engine.member import LAST_PING, MeshMember
from broker.mesh.messages import Ask, Direct, Heartbeat, Snapshot
from broker.options import BrokerOptions
from broker.routing.router import Router
from broker.server import Broker
from proto.aio.read_budget import SHARE_SEC
from proto.wire import frames
from tests.seams.limits import set_limits
from tests.waiting import until

if TYPE_CHECKING:
    import pytest

    from broker.mesh.engine.engine import Host
    from broker.mesh.messages import Message

OTHER = 2


def test_a_warning_names_the_broker_if_its_name_is_known() -> None:
    """Control characters of the name are escaped."""
    lines: list[str] = []
    dispatcher: Any = mock.Mock(options=BrokerOptions())
    dispatcher.admission.rules = None

    def warn(_reason: str, text: str, *values: object) -> None:
        lines.append(text % values)

    dispatcher.warnings.warn = warn
    engine: Any = mock.Mock()
    member = MeshMember(1, dispatcher, lambda _number, _host: engine, "here")
    mesh = member.add(Router()).mesh
    for broker in (2, 3):
        mesh.add_broker(broker)
    mesh.accept_snapshot(2, Snapshot(1, 0, (), "robot\n"))
    for broker in (2, 3):
        mesh.reject(broker, "why")
    assert lines == [
        "Mesh: rejected the broker robot\\n (00000002): why",
        "Mesh: rejected the broker 00000003: why",
    ]


def test_memory_is_returned_after_long_work_for_another_broker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: the periodic check returns it when a broker with many endpoints has come or gone."""
    monkeypatch.setattr(slices, "SLICE", 10)
    dispatcher: Any = mock.Mock(options=BrokerOptions())
    dispatcher.admission.rules, dispatcher.memory.freed = None, False
    dispatcher.budget.clock.return_value = 0.0
    engine: Any = mock.Mock()
    member = MeshMember(1, dispatcher, lambda _number, _host: engine, "here")
    mesh = member.add(Router()).mesh
    for endpoints, freed in ((3, False), (1000, True)):
        mesh.add_broker(OTHER)
        mesh.snapshot(OTHER, 1)
        nodes = tuple(frames.Node(number, f"/n{number}") for number in range(1, endpoints + 1))
        mesh.accept_snapshot(OTHER, Snapshot(9, 0, nodes))
        while mesh.work.pending:
            assert not dispatcher.memory.freed
            member.go_on_reading()
        assert dispatcher.memory.freed is freed
        mesh.remove_broker(OTHER)


async def test_long_work_pauses_between_its_shares() -> None:
    """Case 66: Zenoh's threads and other links get half of the time, and each share has few requests."""
    clock = count()
    dispatcher: Any = mock.Mock(options=BrokerOptions())
    dispatcher.admission.rules = None
    dispatcher.budget.clock = lambda: SHARE_SEC / 5 * next(clock)
    engine: Any = mock.Mock(full=False)
    member = MeshMember(1, dispatcher, lambda _number, _host: engine, "here")
    channel = member.add(Router())
    for broker in range(10, 50):
        channel.mesh.add_broker(broker)
    channel.flush()
    assert not dispatcher.budget.wait.called
    await until(lambda: dispatcher.budget.wait.called)
    dispatcher.budget.wait.assert_called_once_with(member)
    member.go_on_reading()
    asks = [each for call in engine.send.mock_calls for each in call.args[1] if isinstance(each, Ask)]
    assert 0 < len(asks) <= 6


async def test_a_stop_ends_long_work() -> None:
    """Requests for snapshots that are still to be sent find no session of the engine any more."""
    dispatcher: Any = mock.Mock(options=BrokerOptions())
    dispatcher.admission.rules = None
    dispatcher.budget.clock = lambda: 0.0
    engine: Any = mock.Mock(full=False, stop=mock.AsyncMock())
    member = MeshMember(1, dispatcher, lambda _number, _host: engine, "here")
    channel = member.add(Router())
    channel.mesh.add_broker(10)
    channel.flush()
    await until(lambda: dispatcher.budget.wait.called)
    await member.stop()
    member.go_on_reading()
    assert not engine.send.called


class Alone:
    """An engine that knows one other broker, which leaves soon after it has got a last PING.

    Args:
        host: The broker that uses it.

    Attributes:
        calls: What it was asked to do.
        heartbeats: How many it was given.
    """

    full = False
    heartbeats = 0

    def __init__(self, host: Host) -> None:
        self.calls: list[str] = []
        self._host = host

    async def start(self) -> None:
        """Report the other broker, at once."""
        self.calls.append("start")
        mesh = self._host.mesh(0)
        mesh.add_broker(OTHER)
        mesh.accept_snapshot(OTHER, Snapshot(1, 0, ()))
        self._host.flush()

    def join(self, domain: int) -> None:
        """Take part in a graph."""

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages: nobody gets them."""
        for each in messages:
            self.heartbeats += isinstance(each, Heartbeat)
            if isinstance(each, Direct) and each.frame == frames.Ping(LAST_PING):
                self.calls.append(f"ping {each.broker}")
                asyncio.get_running_loop().call_later(0.01, self._leave)

    def _leave(self) -> None:
        self.calls.append("left")
        self._host.mesh(0).remove_broker(OTHER)
        self._host.flush()

    def statistics(self) -> EngineStats:
        """Return nothing."""
        return EngineStats({})

    async def stop(self) -> None:
        """Disconnect."""
        self.calls.append("stop")


async def test_a_broker_starts_its_engine_and_ends_it_behind_a_last_ping(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The end of a session can overtake what was sent before it: the others have to answer first."""
    set_limits(monkeypatch, mesh_heartbeat_sec=0.001)
    engines: list[Alone] = []

    def make(_number: int, host: Host) -> Alone:
        engines.append(Alone(host))
        return engines[0]

    async with Broker(BrokerOptions(port=0), mesh_engine=make):
        await until(lambda: engines[0].heartbeats > 1)
        assert engines[0].calls == ["start"]
    assert engines[0].calls == ["start", f"ping {OTHER}", "left", "stop"]
