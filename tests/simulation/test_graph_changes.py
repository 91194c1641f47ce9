"""The graph's changes as a watcher receives them."""

from __future__ import annotations

import asyncio

import actors
from tests.actors.meeting import BARE
from tests.simulation.network import BROKER, on_host
from tests.simulation.records import Note
from tests.simulation.stage import Stage, play


def follow(node: actors.Node, diary: list[str]) -> asyncio.Task[None]:
    """Write down what a node sees of others."""

    async def read() -> None:
        async for change in node.watch_graph():
            if change.node != node.get_fully_qualified_name():
                what = f"{change.entry_kind.name} {change.node} {change.name}".strip()
                diary.append(f"{change.kind.value} {what}")

    return asyncio.create_task(read())


async def seen(stage: Stage, diary: list[str], *lines: str) -> None:
    """Wait until exactly these lines stand in the diary, and empty it."""
    await stage.until(lambda: len(diary) >= len(lines), 60)
    await asyncio.sleep(0.5)
    assert sorted(diary) == sorted(lines)
    diary.clear()


def test_who_comes_and_goes_is_seen() -> None:
    """Existing entities appear first; then each node and endpoint as it joins and leaves."""

    async def scene(stage: Stage) -> None:
        watcher, talker = await stage.enter("watcher"), await stage.enter("talker")
        diary: list[str] = []
        reader = follow(watcher, diary)
        await seen(stage, diary, "appeared NODE /talker")
        publisher = talker.create_publisher(Note, "red")
        await seen(stage, diary, "appeared PUBLISHER /talker /red")
        talker.destroy_publisher(publisher)
        await seen(stage, diary, "disappeared PUBLISHER /talker /red")
        talker.destroy_node()
        await asyncio.sleep(0.5)
        reader.cancel()
        await asyncio.wait({reader})

    play(scene)


def test_a_silent_node_is_suspended_and_returns_or_goes() -> None:
    """Watchers can tell a frozen node from one that has left, at both ends of its silence."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")
        await stage.enter("talker")
        diary: list[str] = []
        reader = follow(watcher, diary)
        await seen(stage, diary, "appeared NODE /talker")
        stage.network.block("talker", BROKER)
        await seen(stage, diary, "suspended NODE /talker")
        stage.network.heal()
        await seen(stage, diary, "returned NODE /talker")
        stage.network.block("talker", BROKER)
        await seen(stage, diary, "suspended NODE /talker")
        await seen(stage, diary, "disappeared NODE /talker")
        reader.cancel()
        await asyncio.wait({reader})

    play(scene)


def test_a_restart_between_two_snapshots_is_seen() -> None:
    """A node that dies and returns between two reads is two changes, not none."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")

        async def live(stop: asyncio.Event) -> None:
            async with actors.Node("talker", use_global_arguments=False, **BARE):
                await stop.wait()

        stops = [asyncio.Event(), asyncio.Event()]
        with on_host("one"):
            first = asyncio.create_task(live(stops[0]))
        await asyncio.sleep(0.5)
        watch = watcher.watch_graph()
        changes = aiter(watch)
        appeared = [await anext(changes), await anext(changes)]
        assert {change.node for change in appeared} == {"/watcher", "/talker"}
        stops[0].set()
        await first
        with on_host("two"):
            second = asyncio.create_task(live(stops[1]))
        await asyncio.sleep(0.5)
        kinds = [(await anext(changes)).kind, (await anext(changes)).kind]
        assert kinds == [actors.GraphChangeKind.DISAPPEARED, actors.GraphChangeKind.APPEARED]
        stops[1].set()
        await second
        watch.destroy()
        assert [change.kind async for change in changes] == []

    play(scene)


def test_a_new_broker_is_no_change() -> None:
    """After a broker restart nodes that return are no change; missing ones are."""

    async def scene(stage: Stage) -> None:
        watcher, talker = await stage.enter("watcher"), await stage.enter("talker")
        talker.create_publisher(Note, "red")
        talker.create_publisher(Note, "red")
        stop = asyncio.Event()

        async def live() -> None:
            async with actors.Node("other", use_global_arguments=False, **BARE):
                await stop.wait()

        with on_host("other"):
            other = asyncio.create_task(live())
        diary: list[str] = []
        reader = follow(watcher, diary)
        await stage.until(lambda: len(diary) == 4)
        diary.clear()
        await stage.crash_broker()
        stop.set()
        await other
        assert not diary
        stage.network.partition("watcher")  # so that the others are there before it queries the graph
        await stage.start_broker()
        await stage.until(lambda: talker.connected)
        stage.network.heal()
        await stage.until(lambda: watcher.connected, 30)
        await seen(stage, diary, "disappeared NODE /other")
        reader.cancel()
        await asyncio.wait({reader})

    play(scene)


def test_a_watch_ends_with_its_node() -> None:
    """Destroying the node ends the iteration; no task waits forever."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")
        reader = follow(watcher, [])
        await asyncio.sleep(0.5)
        watcher.destroy_node()
        await asyncio.wait_for(reader, 1)

    play(scene)


def test_what_is_silent_over_a_lost_link_is_reported_when_it_is_back() -> None:
    """SUSPENDED is always followed by another change, even if the watcher lost its connection meanwhile."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")
        await stage.enter("talker")
        diary: list[str] = []
        reader = follow(watcher, diary)
        await seen(stage, diary, "appeared NODE /talker")
        stage.network.block("talker", BROKER)
        await seen(stage, diary, "suspended NODE /talker")
        stage.network.drop("watcher")
        await stage.until(lambda: not watcher.connected)
        await stage.until(lambda: watcher.connected)
        await seen(stage, diary, "disappeared NODE /talker")
        stage.network.heal()
        await seen(stage, diary, "appeared NODE /talker")
        reader.cancel()
        await asyncio.wait({reader})

    play(scene)


def test_what_falls_silent_before_any_query_appears_when_it_is_back() -> None:
    """A watcher gets no return of a node whose appearance it has not received."""

    async def scene(stage: Stage) -> None:
        watcher = await stage.enter("watcher")
        watch = watcher.watch_graph()
        changes = aiter(watch)
        assert (await anext(changes)).node == "/watcher"
        await stage.enter("talker")
        stage.network.block("talker", BROKER)
        await asyncio.sleep(8)
        stage.network.heal()
        await asyncio.sleep(1)
        change = await anext(changes)
        assert (change.kind, change.node) == (actors.GraphChangeKind.APPEARED, "/talker")
        watch.destroy()
        assert [change async for change in changes] == []

    play(scene)
