"""Bare nodes come and go at random on one link, while it breaks, is slow, and the broker restarts."""

from __future__ import annotations

import asyncio
from random import Random
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.std_msgs.msg import Int64
from actors.interfaces.std_srvs.srv import Trigger
from proto.wire.codes import EntryKind
from tests.actors.meeting import KEEP_ALL
from tests.simulation.network import LinkFaults
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from actors import BareNode

TOPICS = ("/red", "/blue")
APART = ("", "one", "two")


class Gateway:
    """A node whose bare nodes publish, subscribe, serve and call at random."""

    def __init__(self, owner: actors.Node, draw: Random) -> None:
        self.owner = owner
        self.draw = draw
        self.bare: dict[BareNode, list[actors.Publisher[Any]]] = {}
        self.clients: dict[BareNode, actors.Client[Any, Any]] = {}
        self.mixed: list[str] = []
        """What an endpoint has got from one from which it is kept apart."""

    def create(self) -> None:
        """Make a bare node, at times with the name that another one has just had."""
        draw = self.draw
        apart = draw.choice(APART)
        bare = self.owner.create_bare_node(
            f"n{draw.randrange(30)}", labels={"apart": apart}, apart=apart, shared_name=True
        )
        sent = APART.index(apart) + 1
        profiles: list[int | actors.QoSProfile] = [1, 10, KEEP_ALL]
        qos = draw.choice(profiles)
        self.bare[bare] = [bare.create_publisher(Int64, topic, qos) for topic in draw.sample(TOPICS, 1)]

        def read(message: Int64) -> None:
            if message.data == sent and apart:
                self.mixed.append(f"a message for {apart}")

        async def serve(request: Trigger.Request) -> Trigger.Response:
            del request
            await asyncio.sleep(0.01)
            return Trigger.Response(message=apart)

        for topic in TOPICS:
            bare.create_subscription(Int64, topic, read, qos)
        if draw.random() < 0.5:
            bare.create_service(Trigger, "/do", serve, concurrent=True)
        self.clients[bare] = bare.create_client(Trigger, "/do")

    def destroy(self) -> None:
        """Destroy one, in the turn in which it has published."""
        bare = self.draw.choice([*self.bare])
        self.publish(bare)
        del self.bare[bare], self.clients[bare]
        bare.destroy()

    def publish(self, bare: BareNode) -> None:
        """Publish a few messages, which say what they are kept apart from."""
        for publisher in self.bare[bare]:
            for _ in range(self.draw.randrange(20)):
                publisher.publish(Int64(data=APART.index(bare.apart) + 1))

    async def call(self, bare: BareNode, client: actors.Client[Any, Any]) -> None:
        """Call whoever serves; a call may fail, but never reach a server that is kept apart."""
        try:
            answer = await client.call(Trigger.Request(), timeout_sec=2)
        except (actors.CallFailed, actors.NodeDestroyed):
            return
        if bare.apart and answer.message == bare.apart:
            self.mixed.append(f"a call for {bare.apart}")

    def step(self) -> None:
        """Do something."""
        what = self.draw.random()
        if what < 0.2 or not self.bare:
            self.create()
        elif what < 0.35:
            self.destroy()
        else:
            self.publish(self.draw.choice([*self.bare]))


def expected(gateways: list[Gateway]) -> list[str]:
    """Return the names of the nodes that are to be in the graph."""
    names = [bare.get_fully_qualified_name() for gateway in gateways for bare in gateway.bare]
    return sorted([*names, *(gateway.owner.get_fully_qualified_name() for gateway in gateways), "/watcher"])


async def live(stage: Stage, gateways: list[Gateway], draw: Random) -> None:
    """Let the gateways do something, and much go wrong."""
    calls: list[asyncio.Task[None]] = []
    for step in range(400):
        gateway = draw.choice(gateways)
        gateway.step()
        if gateway.clients and draw.random() < 0.2:
            bare, client = draw.choice([*gateway.clients.items()])
            calls.append(asyncio.create_task(gateway.call(bare, client)))
        if draw.random() < 0.3:
            await asyncio.sleep(draw.choice([0.0, 0.001, 0.05]))
        if step in {150, 300}:
            await _disturb(stage, draw)
    stage.network.heal()
    await asyncio.wait(calls)


@pytest.mark.parametrize("seed", range(6))
def test_bare_nodes_survive_everything_and_stay_apart(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    """The graph is right afterwards, no frame was wrong, and nothing went where it must not go."""

    async def scene(stage: Stage) -> None:
        draw = Random(seed)
        if seed % 2:
            slow = LinkFaults(delay=0.02, segment=100, window=2000, read_pause=0.001)
            stage.network.choose_link_faults = lambda _: slow
        gateways = [Gateway(await stage.enter(name), draw) for name in ("one", "other")]
        watcher = await stage.enter("watcher")
        await live(stage, gateways, draw)
        await stage.until(lambda: all(each.owner.connected for each in gateways) and watcher.connected, 30)
        for bare in (bare for gateway in gateways for bare in gateway.bare):
            assert await bare.wait_until_accepted(30)
        async with asyncio.timeout(60):
            while (graph := await watcher.get_graph()).nodes() != expected(gateways):
                await asyncio.sleep(0.1)
        owned = sum(len(each) for gateway in gateways for each in gateway.bare.values())
        assert len(list(graph.of_kind(EntryKind.PUBLISHER))) == owned
        assert [each for gateway in gateways for each in gateway.mixed] == []

    play(scene, seed)
    lines = [record.getMessage() for record in caplog.records if "Closing" in record.getMessage()]
    assert [line for line in lines if "TAKEN_OVER" not in line and "TIMEOUT" not in line] == []


async def _disturb(stage: Stage, draw: Random) -> None:
    """Break links, or restart the broker."""
    what = draw.choice(["partition", "crash", "restart"])
    if what == "partition":
        stage.network.partition("one")
        await asyncio.sleep(draw.choice([0.5, 8.0]))
        stage.network.heal()
    elif what == "crash":
        await stage.crash_broker()
        await stage.start_broker()
    else:
        await stage.stop_broker()
        await stage.start_broker()
