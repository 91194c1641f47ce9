"""SIGINT and SIGTERM end every program cleanly, with and without a broker."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import time
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from tests.actors.meeting import KEEP_ALL, until
from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from tests.integration.conftest import Program, System

SIGNALS = (signal.SIGINT, signal.SIGTERM)
PROGRAMS = {
    "minimal_publisher": "Publishing",
    "minimal_subscriber": "I heard",
    "publishing_subscriber": "I heard",
    "add_two_ints_server": "sending back response",
    "add_two_ints_client": "service not available",
    "course_decorated": "Sum",
}
"""And what shows that each is at work."""
BOUND_SEC = 20.0
"""Longer than stops may take: 5 s for a broker that does not answer, and exits of six interpreters on a busy
machine. What waits for something that never comes takes longer."""


STARTING = """
import actors

class Args(list):
    def __iter__(self):
        print("starting", flush=True)
        return super().__iter__()

actors.run(lambda: actors.Node("node"), args=Args())
"""
"""Says so from within `actors.run`, which looks at its arguments first."""


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize("name", PROGRAMS)
async def test_programs_end_cleanly_without_a_broker(
    system: System, name: str, number: signal.Signals
) -> None:
    """A program that waits for its broker exits with 0, without a traceback."""
    program = await system.example(name, *(("5", "3") if name.endswith("client") else ()))
    await program.wait_for_line("No broker at")
    program.send_signal(number)
    start = time.monotonic()
    assert await program.wait_for_exit() == 0
    assert time.monotonic() - start < BOUND_SEC
    assert "Traceback" not in program.output


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
async def test_programs_end_cleanly_at_work(system: System, number: signal.Signals) -> None:
    """All programs of the course, and then the broker, exit with 0 and without a traceback."""
    daemon = await system.broker()
    names = [name for name in PROGRAMS if name not in {"add_two_ints_client", "course_decorated"}]
    programs = {name: await system.example(name) for name in names}
    client = await system.example("add_two_ints_client", "5", "3")
    assert await client.wait_for_exit() == 0
    for name, program in programs.items():
        await program.wait_for_line(PROGRAMS[name])
    start = time.monotonic()
    for program in (*programs.values(), daemon):
        program.send_signal(number)
        assert await program.wait_for_exit() == 0
        assert "Traceback" not in program.output
    assert time.monotonic() - start < BOUND_SEC


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
async def test_client_that_waits_says_that_it_was_interrupted(system: System, number: signal.Signals) -> None:
    """While it waits for a server it logs one line and exits with 0."""
    await system.broker()
    client = await system.example("add_two_ints_client", "5", "3")
    await client.wait_for_line("service not available, waiting again...")
    client.send_signal(number)
    assert await client.wait_for_exit() == 0
    assert client.lines[-1].endswith("Interrupted while waiting for the service. Exiting.")
    assert "Traceback" not in client.output


async def test_programs_outlive_a_broker_that_stops_and_then_end_cleanly(system: System) -> None:
    """They wait for a new broker, and a signal still ends them."""
    daemon = await system.broker()
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.wait_for_line("I heard")
    assert await daemon.stop() == 0
    for program in (publisher, subscriber):
        await program.wait_for_line("No broker at")
        assert await program.stop() == 0
        assert "Traceback" not in program.output


async def test_a_frozen_broker_does_not_block_stopping(system: System) -> None:
    """A program whose broker does not respond still ends within its limit."""
    daemon = await system.broker()
    publisher = await system.example("minimal_publisher")
    subscriber = await system.example("minimal_subscriber")
    await subscriber.wait_for_line("I heard")
    daemon.send_signal(signal.SIGSTOP)
    start = time.monotonic()
    for program in (publisher, subscriber):
        program.send_signal(signal.SIGINT)
    for program in (publisher, subscriber):
        assert await program.wait_for_exit() == 0
        assert "Traceback" not in program.output
    assert time.monotonic() - start < 2 * BOUND_SEC


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize("imported", [False, True], ids=["imports", "starts the loop"])
async def test_a_signal_before_the_loop_runs_ends_a_program_cleanly(
    system: System, *, imported: bool, number: signal.Signals
) -> None:
    """The signal is handled from the call of `actors.run` on, also while it imports and starts the loop."""
    for _ in range(5):
        program = await system.python("-c", STARTING, forked=imported)
        await program.wait_for_line("starting")
        program.send_signal(number)
        assert await program.wait_for_exit() == 0
        assert "Traceback" not in program.output


STOPPING = """
import asyncio, signal
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts

class Server(actors.Node):
    def __init__(self):
        super().__init__("server", stop_timeout_sec={timeout})
        self.create_service(AddTwoInts, "add", self.add)

    async def add(self, request):
        {body}
        return AddTwoInts.Response(sum=request.a + request.b)

actors.run(Server)
print("returned", flush=True)
"""
UNTIL_SIGUSR1 = """done = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, done.set)
        print("handling", flush=True)
        await done.wait()"""
STUBBORN = """print("handling", flush=True)
        while True:
            try:
                await asyncio.sleep(3600)
            except asyncio.CancelledError:
                print("ignored", flush=True)"""
EXITING = """
import sys
import actors

class Node(actors.Node):
    def __init__(self):
        super().__init__("node")
        self.timer = self.create_timer(0, self.tick)

    {kind} tick(self):
        if self.timer.ticks == 20:
            sys.exit(7)

actors.run(Node)
"""


async def calling(system: System, program: str) -> tuple[Program, asyncio.Task[int]]:
    """Start a broker, a server and a calling node; return when the server handles the call."""
    await system.broker()
    server = await system.python("-c", program)
    caller = actors.Node("caller", url=system.url)
    client = caller.create_client(AddTwoInts, "add")

    async def call() -> int:
        async with caller:
            assert await client.wait_for_service(DEADLINE_SEC)
            return (await client.call(AddTwoInts.Request(a=40, b=2))).sum

    task = asyncio.create_task(call())
    await server.wait_for_line("handling")
    return server, task


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
async def test_a_running_handler_may_reply(system: System, number: signal.Signals) -> None:
    """After a signal the caller still gets its reply, then the program exits with 0."""
    server, call = await calling(system, STOPPING.format(timeout=30, body=UNTIL_SIGUSR1))
    server.send_signal(number)
    await server.wait_for_line("Stopping: up to 30 s")
    server.send_signal(signal.SIGUSR1)
    assert await call == 42
    assert await server.wait_for_exit() == 0
    assert server.lines[-1] == "returned"


async def test_a_handler_that_ignores_its_cancellation_does_not_block_stopping(system: System) -> None:
    """The log names it, its caller gets an error, and the program exits with 0 in time."""
    server, call = await calling(system, STOPPING.format(timeout=0.1, body=STUBBORN))
    server.send_signal(signal.SIGTERM)
    start = time.monotonic()
    with pytest.raises(actors.ServiceUnavailable):
        await call
    assert await server.wait_for_exit() == 0
    assert time.monotonic() - start < BOUND_SEC
    assert "Server.add" in server.output
    assert server.lines[-1] == "returned"
    for noise in ("Traceback", "Task was destroyed", "never retrieved", "Exception ignored"):
        assert noise not in server.output


async def test_a_second_signal_cancels_callbacks(system: System) -> None:
    """A second Ctrl-C does not wait for callbacks."""
    program = STOPPING.format(timeout=3600, body=UNTIL_SIGUSR1)
    server, call = await calling(system, program)
    server.send_signal(signal.SIGINT)
    await server.wait_for_line("Stopping: up to 3600 s")
    server.send_signal(signal.SIGINT)
    start = time.monotonic()
    with pytest.raises(actors.ServiceUnavailable):
        await call
    assert await server.wait_for_exit() == 0
    assert time.monotonic() - start < BOUND_SEC
    assert "Traceback" not in server.output


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_an_exit_in_a_busy_timer_ends_the_process(system: System, kind: str) -> None:
    """sys.exit(7) in a callback that runs in every loop turn exits with 7, without a traceback."""
    program = await system.python("-c", EXITING.format(kind=kind))
    assert await program.wait_for_exit() == 7
    assert "Traceback" not in program.output


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
async def test_a_broker_that_stops_under_load_delivers_all_accepted_messages(
    system: System, number: signal.Signals
) -> None:
    """KEEP_ALL: every message sent is received; the others stay queued at the publisher."""
    daemon = await system.broker()
    received: list[int] = []
    async with actors.Node("source", url=system.url) as source, actors.Node("sink", url=system.url) as sink:

        async def take(message: Int64) -> None:
            received.append(message.data)
            if message.data % 1000 == 0:
                await asyncio.sleep(0.001)

        sink.create_subscription(Int64, "numbers", take, KEEP_ALL)
        publisher = source.create_publisher(Int64, "numbers", KEEP_ALL)
        await until(lambda: publisher.get_subscription_count() == 1)

        async def publish() -> None:
            while publisher.get_subscription_count():
                with contextlib.suppress(actors.WaitTimeout):
                    await publisher.ready(1)
                    for _ in range(100):
                        publisher.publish(Int64(data=publisher.published))
                await asyncio.sleep(0)

        publishing = asyncio.create_task(publish())
        await until(lambda: len(received) > 5000)
        daemon.send_signal(number)
        assert await daemon.wait_for_exit() == 0
        await publishing
        sent = publisher.published - publisher.queued
        await until(lambda: len(received) >= sent)
        assert received == list(range(sent))
