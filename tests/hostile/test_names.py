"""Names that are contested: a silent node keeps its name for a while, and a running node does not end."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from tests.seams.nodes import context_of
from tests.simulation.network import on_host
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    import pytest


def lines(caplog: pytest.LogCaptureFixture, text: str) -> int:
    """Return how many log lines contain a text."""
    return sum(text in record.getMessage() for record in caplog.records)


async def suspended(stage: Stage, host: str, watcher: actors.Node) -> None:
    """Cut a host off until its node has left the graph."""
    stage.network.partition(host)
    while "same" in await watcher.get_node_names():
        await asyncio.sleep(0.1)


def test_a_silent_node_keeps_its_name_for_a_while(caplog: pytest.LogCaptureFixture) -> None:
    """Case 55: a node that starts while the holder is silent waits, with one line; the holder comes back."""

    async def scene(stage: Stage) -> None:
        watcher, holder = await stage.enter("watcher"), await stage.enter("same", host="first")
        await suspended(stage, "first", watcher)
        outcome: list[str] = []

        async def contend() -> None:
            try:
                async with actors.Node("same", use_global_arguments=False):
                    outcome.append("entered")
            except actors.NodeNameTaken:
                outcome.append("taken")

        with on_host("second"):
            contender = asyncio.create_task(contend())
        await asyncio.sleep(4)
        assert outcome == []
        assert lines(caplog, "is silent; this one gets its name") == 1
        stage.network.heal()
        await contender
        assert outcome == ["taken"]
        assert holder.connected
        assert (await watcher.get_node_names()).count("same") == 1

    play(scene)


def test_a_node_that_lost_its_name_waits_for_it(caplog: pytest.LogCaptureFixture) -> None:
    """Case 55: after the grace time another node gets the name; the first one goes on and tries again."""

    async def scene(stage: Stage) -> None:
        watcher, holder = await stage.enter("watcher"), await stage.enter("same", host="first")
        await suspended(stage, "first", watcher)
        began = stage.loop.time()
        with on_host("second"):
            async with actors.Node("same", use_global_arguments=False) as heir:
                assert heir.connected
                grace = stage.options.name_grace_sec
                assert grace < stage.loop.time() - began < grace + 4
                stage.network.heal()
                await asyncio.sleep(30)
                assert lines(caplog, "A node named '/same' is there already") == 1
                assert lines(caplog, "trying again") == 1
        await stage.until(lambda: holder.connected and context_of(holder).declared)
        assert (await watcher.get_node_names()).count("same") == 1

    play(scene)
