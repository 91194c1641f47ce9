"""Shared memory: another user gets nothing of it, and nobody makes the broker map more than its limits."""

from __future__ import annotations

import asyncio
import sys
import threading
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Final

import pytest

from broker import Broker, BrokerOptions
from broker.serving import shared_memory
from proto.aio.arena import MAX_ARENA_BYTES, Arena, host_identity
from proto.errors import ErrorCode
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link, proof_for, until
from tests.broker.serving.test_shared_memory import Sender
from tests.system import change_user

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

HOST = host_identity()
SPARSE_BYTES: Final = 2**24
STRANGER: Final = """
import sys
from proto.aio.arena import Arena
arena = Arena(4096)
announced = arena.announcement
print(announced.process, announced.descriptor, announced.token.hex(), flush=True)
sys.stdin.read()
"""


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


async def test_a_proof_is_worth_nothing_on_another_connection(broker: Broker) -> None:
    """A false broker that gives its own session to a node of the user cannot use what the node answers."""
    async with RawClient().connected(broker) as victim, RawClient().connected(broker) as thief:
        thief.send(hello(host=HOST))
        welcome = await thief.next(frames.Welcome)
        thief.send(proof_for(welcome, victim.channel))
        thief.send(Arena(2**20).announcement)
        assert "not proved" in (await thief.next(frames.Mapped)).problem
        thief.send(proof_for(welcome, thief.channel))
        await thief.synchronise()
    assert broker.stats().refused_arenas == 2


async def test_another_user_at_the_socket_file_is_offered_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An insecure broker lets it connect, but there its proof would not be bound to a connection."""
    change_user(monkeypatch)
    async with (
        Broker(BrokerOptions(unix=tmp_path / "s", insecure=True)) as broker,
        RawClient().connected(broker) as thief,
    ):
        thief.send(hello(host=HOST))
        assert "secret_process" not in (await thief.next(frames.Welcome)).options


async def test_nobody_uses_the_arena_of_another_link(broker: Broker) -> None:
    """A reader that sends back what was announced to it gets nothing."""
    async with link(broker, "/victim", host=HOST) as victim, link(broker, "/thief", host=HOST) as thief:
        source = Sender(victim)
        await source.declare()
        thief.send(source.arena.announcement)
        assert "another link" in (await thief.next(frames.Mapped)).problem


async def test_ended_arenas_count_while_something_of_them_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that keeps one message of each link lets the broker map no more than its limit."""
    monkeypatch.setattr(shared_memory, "MAX_ARENAS", 2)
    async with Broker(BrokerOptions(port=0)) as broker, link(broker, "/reader", host=HOST) as reader:
        reader.send(make.subscription(1))
        await reader.next(frames.Accepted)
        for _ in range(2):
            async with link(broker, "/sender", host=HOST) as client:
                source = Sender(client)
                await source.declare()
                client.send(source.reference())
                reader.send(frames.Mapped((await reader.next(frames.Arena)).id, ""))
                await reader.synchronise()
                client.send(source.reference())
                await reader.next(frames.Reference)
            await reader.next(frames.Detached)
        async with link(broker, "/sender", host=HOST) as client:
            third = Sender(client)
            client.send(third.arena.announcement)
            assert "too many arenas" in (await client.next(frames.Mapped)).problem
        reader.send(frames.Release((0,)))
        await reader.next(frames.Unmap)
        async with link(broker, "/sender", host=HOST) as client:
            await Sender(client).declare()


async def test_arenas_are_limited_in_bytes(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Together, and each: one held message keeps all memory of its arena."""
    monkeypatch.setattr(shared_memory, "MAX_TOTAL_BYTES", 2**26)
    async with link(broker, "/one", host=HOST) as one, link(broker, "/two", host=HOST) as two:
        await Sender(one).declare()
        two.send(Sender(two, 2**25 + 4096).arena.announcement)
        assert "too many arenas" in (await two.next(frames.Mapped)).problem
    monkeypatch.undo()
    async with link(broker, "/three", host=HOST) as three:
        three.send(Sender(three, MAX_ARENA_BYTES + 4096).arena.announcement._replace(token=bytes(16)))
        assert "not supported" in (await three.next(frames.Mapped)).problem


async def test_sparse_arenas_count_as_what_they_can_become() -> None:
    """Case 87: together they are not larger than the broker's memory may be, however little is in them."""
    options = BrokerOptions(port=0, max_broker_bytes=4 * SPARSE_BYTES)
    async with AsyncExitStack() as stack:
        broker = await stack.enter_async_context(Broker(options))
        problems: list[str] = []
        arenas: list[Arena] = []
        for number in range(6):
            client = await stack.enter_async_context(link(broker, f"/n{number}", host=HOST))
            arenas.append(Arena(SPARSE_BYTES))
            client.send(arenas[-1].announcement)
            problems.append((await client.next(frames.Mapped)).problem)
        assert problems[0] == ""
        assert sum(not problem for problem in problems) <= 4
        assert all("too many arenas" in problem for problem in problems if problem)


@pytest.mark.parametrize("in_threads", [False, True])
async def test_one_process_leaves_arenas_to_others(
    monkeypatch: pytest.MonkeyPatch, *, in_threads: bool
) -> None:
    """Case 88: it has about half of them at most, also if it names its threads; others map theirs."""
    monkeypatch.setattr(shared_memory, "MAX_ARENAS", 8)
    done = threading.Event()
    threads = [threading.Thread(target=done.wait) for _ in range(10)]
    for thread in threads:
        thread.start()
    pipe = asyncio.subprocess.PIPE
    stranger = await asyncio.create_subprocess_exec(sys.executable, "-c", STRANGER, stdin=pipe, stdout=pipe)
    try:
        async with AsyncExitStack() as stack:
            broker = await stack.enter_async_context(Broker(BrokerOptions(port=0)))
            problems: list[str] = []
            arenas: list[Arena] = []
            for number, thread in enumerate(threads):
                client = await stack.enter_async_context(link(broker, f"/n{number}", host=HOST))
                arenas.append(Arena(4096))
                announced = arenas[-1].announcement
                assert thread.native_id is not None
                client.send(announced._replace(process=thread.native_id) if in_threads else announced)
                problems.append((await client.next(frames.Mapped)).problem)
            assert problems[:4] == [""] * 4
            assert "of this process" in problems[5]
            assert stranger.stdout is not None
            process, descriptor, token = (await stranger.stdout.readline()).decode().split()
            other = await stack.enter_async_context(link(broker, "/other", host=HOST))
            other.send(frames.Arena(1, int(process), int(descriptor), 4096, bytes.fromhex(token)))
            assert (await other.next(frames.Mapped)).problem == ""
    finally:
        done.set()
        await stranger.communicate(b"")


async def test_a_publisher_that_reads_nothing_loses_its_link(tmp_path: Path) -> None:
    """What the broker releases waits for it like any control frame, and has the same limit."""
    options = BrokerOptions(unix=tmp_path / "s", max_queue_bytes=65536, drain_timeout_sec=0.2)
    async with Broker(options) as broker, link(broker, "/sender", host=HOST) as client:
        source = Sender(client)
        await source.declare()
        reference = source.reference()
        client.stop_reading()
        number = 0
        while broker.stats().endpoints and number < 400_000:
            many = range(number, number := number + 4000)
            client.send(*(reference._replace(first_sequence=each) for each in many))
            await until(lambda: broker.stats().shared_received == number or not broker.stats().endpoints)
        assert not broker.stats().endpoints
        client.go_on_reading()
        assert (await client.next(frames.Error)).code == ErrorCode.LIMIT
