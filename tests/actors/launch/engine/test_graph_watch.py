"""The graph that a launch watches."""

from __future__ import annotations

import asyncio
import math
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from actors.config.contexts import find_broker_target
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.launch.engine.graph_watch import Presences, graph_watch
from actors.launch.planning.presence import Presence, PresenceKind, presence_of
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry
from tests.actors.meeting import until
from tests.simulation.network import BROKER, on_host
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    import pytest

    from tests.actors.meeting import Meeting


def names(there: set[Presence]) -> set[str]:
    """Return what is there as people write it."""
    return {str(each) for each in there}


@asynccontextmanager
async def watched(stage: Stage) -> AsyncIterator[list[set[str]]]:
    """Watch the graph from a host "launch"; give what was reported so far."""
    said: list[set[str]] = []
    with on_host("launch"):
        watching = graph_watch(find_broker_target(), "_launch_1", lambda now: said.append(names(now)))
        await watching.__aenter__()
    try:
        yield said
    finally:
        await watching.__aexit__(None, None, None)


async def last(stage: Stage, said: list[set[str]], *expected: str, limit: float = 60.0) -> None:
    """Wait until this is what is there."""
    await stage.until(lambda: bool(said) and said[-1] == set(expected), limit)


def test_nodes_topics_and_services_are_seen() -> None:
    """What is there, as it comes and goes: a topic while one publisher is left, the watcher never."""

    async def scene(stage: Stage) -> None:
        talker = await stage.enter("talker")
        async with watched(stage) as said:
            await last(stage, said, "node /talker")
            assert len(said) == 1
            publishers = [talker.create_publisher(String, "chatter") for _ in range(2)]
            talker.create_subscription(String, "heard", lambda msg: None)
            talker.create_client(AddTwoInts, "asked")
            service = talker.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
            await last(stage, said, "node /talker", "topic /chatter", "service /add")
            talker.destroy_publisher(publishers[0])
            talker.destroy_service(service)
            await last(stage, said, "node /talker", "topic /chatter")
            talker.destroy_publisher(publishers[1])
            await last(stage, said, "node /talker")
            talker.destroy_node()
            await last(stage, said)

    play(scene)


def test_a_frozen_node_is_not_there_until_it_is_back() -> None:
    """Whoever is silent is gone; when the link is closed at last, it does not go again."""

    async def scene(stage: Stage) -> None:
        talker = await stage.enter("talker")
        talker.create_publisher(String, "chatter")
        async with watched(stage) as said:
            for _ in range(2):
                await last(stage, said, "node /talker", "topic /chatter")
                stage.network.block("talker", BROKER)
                await last(stage, said)
                stage.network.heal()
            await last(stage, said, "node /talker", "topic /chatter")
            stage.network.block("talker", BROKER)
            await last(stage, said)
            count = len(said)
            await asyncio.sleep(stage.options.suspend_close_sec + 10)
            assert len(said) == count

    play(scene)


def test_without_a_broker_the_last_snapshot_is_kept() -> None:
    """While the broker is away nothing is reported; what the next one has then holds."""

    async def scene(stage: Stage) -> None:
        await stage.enter("talker")
        listener = await stage.enter("listener")
        async with watched(stage) as said:
            await last(stage, said, "node /talker", "node /listener")
            await stage.stop_broker()
            count = len(said)
            listener.destroy_node()
            await asyncio.sleep(5)
            assert len(said) == count
            await stage.start_broker()
            await last(stage, said, "node /talker")

    play(scene)


def test_a_broker_may_come_later() -> None:
    """Entering waits for none; leaving does not either."""

    async def scene(stage: Stage) -> None:
        await stage.stop_broker()
        began = stage.loop.time()
        async with watched(stage) as said:
            assert stage.loop.time() == began
            await stage.start_broker()
            await stage.enter("talker")
            await last(stage, said, "node /talker")
            await stage.stop_broker()
            began = stage.loop.time()
        assert stage.loop.time() - began < 2
        async with watched(stage):
            began = stage.loop.time()
        assert stage.loop.time() - began < 2
        await stage.start_broker()

    play(scene)


def test_leaving_ends_with_a_broker_that_is_silent() -> None:
    """A dead line holds a launch up for two seconds at most."""

    async def scene(stage: Stage) -> None:
        await stage.enter("talker")
        async with watched(stage) as said:
            await last(stage, said, "node /talker")
            stage.network.block("launch", BROKER)
            began = stage.loop.time()
        assert stage.loop.time() - began <= 2

    play(scene)


async def test_a_broker_that_refuses_the_node_ends_no_launch(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """The launch goes on without the graph, and says why."""
    await meeting.node("_launch_1")
    async with graph_watch(find_broker_target(meeting.url), "_launch_1", lambda now: None):
        await until(lambda: "cannot see which nodes are there" in caplog.text)


async def test_a_failed_watch_starts_again(meeting: Meeting, caplog: pytest.LogCaptureFixture) -> None:
    """A bug in what it tells is logged; what comes later is still told."""
    told: list[set[Presence]] = []
    errors = [RuntimeError("a bug")]

    def notify(now: set[Presence]) -> None:
        if errors:
            raise errors.pop()
        told.append(now)

    await meeting.node("talker")
    async with graph_watch(find_broker_target(meeting.url), "_launch_1", notify):
        await until(lambda: told)
    assert "RuntimeError: a bug" in caplog.text


async def test_a_cancelled_exit_leaves_nothing_behind() -> None:
    """Who is cancelled while leaving still leaves, and is cancelled then."""
    before = asyncio.all_tasks()
    left = asyncio.Event()

    async def launch() -> None:
        async with graph_watch(
            find_broker_target("callboard+unix:///nowhere"), "_launch_1", lambda now: None
        ):
            left.set()
            await asyncio.sleep(math.inf)

    task = asyncio.create_task(launch())
    await left.wait()
    task.cancel()
    await asyncio.sleep(0)
    task.cancel()
    await asyncio.wait({task})
    assert task.cancelled()
    assert asyncio.all_tasks() == before


def entry(key: int, kind: EntryKind, node: str, name: str = "") -> GraphEntry:
    """Return what a broker tells of a node or an endpoint."""
    return GraphEntry(key, kind, node, name, "", "", {})


def test_the_same_as_from_a_whole_snapshot() -> None:
    """Following changes comes to what a look at everything gives, also when numbers get another meaning."""
    known = Presences(own_node="/me")
    entries = (
        entry(1, EntryKind.NODE, "/me"),
        entry(2, EntryKind.SERVICE, "/me", "/me/get"),
        entry(3, EntryKind.NODE, "/a"),
        entry(4, EntryKind.PUBLISHER, "/a", "/t"),
        entry(5, EntryKind.PUBLISHER, "/a", "/t"),
        entry(6, EntryKind.SUBSCRIPTION, "/a", "/u"),
    )
    snapshot = GraphSnapshot({each.key: each for each in entries})
    assert known.follow(snapshot)
    assert known.now == {Presence(PresenceKind.NODE, "/a"), Presence(PresenceKind.TOPIC, "/t")}
    first = known.now
    assert not known.follow(snapshot)
    del snapshot.entries[4]
    assert not known.follow(snapshot)
    other = GraphSnapshot({4: entry(4, EntryKind.NODE, "/a"), 5: entry(5, EntryKind.SERVICE, "/a", "/t")})
    assert known.follow(other)
    assert known.now == {presence_of(each) for each in other.entries.values()} - {None}
    assert first == {Presence(PresenceKind.NODE, "/a"), Presence(PresenceKind.TOPIC, "/t")}
