"""A node without a broker, or with one that does not answer: every wait ends in time."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.node.node_runner import STOP_TIMEOUT_SEC
from tests.simulation.loop import SimulatedLoop, simulate
from tests.simulation.network import BROKER, on_host
from tests.simulation.records import Ask, Note

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import Any


class Mute(asyncio.BufferedProtocol):
    """A peer that accepts a connection and never sends a byte."""

    def __init__(self) -> None:
        self._buffer = bytearray(10_000)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer


def lonely(
    body: Callable[[SimulatedLoop, actors.Node], Coroutine[Any, Any, None]],
    *,
    mute: bool,
    leaves_within: float = 1.0,
) -> None:
    """Run `body(loop, node)` in a node whose broker is not there, or mute; nothing may be left."""

    async def main(loop: SimulatedLoop) -> None:
        if mute:
            with on_host(BROKER):
                listener = await loop.create_server(Mute, "127.0.0.1", 7411)
        with on_host("node"):
            async with actors.Node("lonely", use_global_arguments=False) as node:
                await body(loop, node)
                began = loop.time()
        assert loop.time() - began < leaves_within
        if mute:
            listener.close()
            await listener.wait_closed()
        assert not loop.network.open
        assert asyncio.all_tasks() == {asyncio.current_task()}

    simulate(main)


@pytest.mark.parametrize("mute", [False, True])
@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.01, 1.0, 60.0])
def test_a_node_without_a_broker_stops(seconds: float, *, mute: bool) -> None:
    """It stops at once, or after `stop_timeout_sec` if the broker does not answer."""

    async def body(loop: SimulatedLoop, node: actors.Node) -> None:
        node.create_publisher(Note, "red").publish(Note())
        node.create_subscription(Note, "red", lambda _: None)
        await asyncio.sleep(seconds)

    lonely(body, mute=mute, leaves_within=STOP_TIMEOUT_SEC + 0.1 if mute else 0.1)


@pytest.mark.parametrize("mute", [False, True])
def test_a_call_without_a_broker_fails_at_its_deadline(*, mute: bool) -> None:
    """Before the first session calls wait within their deadline, like wait_for_service."""

    async def body(loop: SimulatedLoop, node: actors.Node) -> None:
        client = node.create_client(Ask, "double")
        began = loop.time()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(Ask.Request(), 10.0)
        assert loop.time() == pytest.approx(began + 10)
        assert not await client.wait_for_service(2.0)
        assert loop.time() == pytest.approx(began + 12)

    lonely(body, mute=mute)


@pytest.mark.parametrize("mute", [False, True])
def test_waits_without_a_broker_end_at_their_timeout(*, mute: bool) -> None:
    """flush() and graph queries raise at their timeout."""

    async def body(loop: SimulatedLoop, node: actors.Node) -> None:
        publisher = node.create_publisher(Note, "red")
        publisher.publish(Note())
        began = loop.time()
        with pytest.raises(actors.WaitTimeout):
            await publisher.flush(1.5)
        assert loop.time() == pytest.approx(began + 1.5)
        with pytest.raises(actors.BrokerUnreachable):
            await node.get_node_names_and_namespaces()
        assert loop.time() < began + 10

    lonely(body, mute=mute, leaves_within=STOP_TIMEOUT_SEC + 0.1)


@pytest.mark.parametrize("mute", [False, True])
@pytest.mark.parametrize(("timeout_sec", "warns"), [(2.0, False), (20.0, True)])
def test_a_connect_timeout_holds(
    timeout_sec: float, caplog: pytest.LogCaptureFixture, *, warns: bool, mute: bool
) -> None:
    """`connect_timeout_sec` raises BrokerUnreachable then; a warning precedes it only if that is late."""

    async def main(loop: SimulatedLoop) -> None:
        if mute:
            with on_host(BROKER):
                listener = await loop.create_server(Mute, "127.0.0.1", 7411)
        with on_host("node"), pytest.raises(actors.BrokerUnreachable):
            async with actors.Node("lonely", connect_timeout_sec=timeout_sec, use_global_arguments=False):
                pass
        assert loop.time() < timeout_sec + 0.5
        assert ("waiting for one" in caplog.text) is warns
        if mute:
            listener.close()
            await listener.wait_closed()

    simulate(main)
