"""An inspector sees what a node sees, is seen by nobody, and ends each question in time."""

from __future__ import annotations

import asyncio
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest

import actors
from actors.errors import BrokerUnreachable
from actors.graph import inspector as inspector_module
from actors.graph.inspector import Inspector
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import definition, type_hash
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from broker.serving import connection
from proto import limits
from proto.errors import ErrorCode, InvalidUrlError, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from tests.actors.meeting import DEADLINE_SEC, until
from tests.seams.limits import be_patient, set_limits
from tests.seams.nodes import limit_questions, note_greetings

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator
    from pathlib import Path
    from typing import TypeVar

    T = TypeVar("T")


@pytest.fixture
async def broker(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Broker]:
    """A broker in the test's loop; inspectors block, so they look from a thread."""
    be_patient(monkeypatch)
    async with Broker(BrokerOptions(port=0)) as running:
        yield running


async def look(url: str, question: Callable[[Inspector], T], **options: float) -> T:
    """Ask one question in a thread."""

    def ask() -> T:
        with Inspector(url, **{"timeout_sec": DEADLINE_SEC, **options}) as inspector:  # type: ignore[arg-type]  # domain is an int
            return question(inspector)

    return await asyncio.to_thread(ask)


async def test_the_graph_is_what_a_node_sees(broker: Broker) -> None:
    """Every entry, with types, hashes and QoS; nothing of the inspector itself."""
    async with actors.Node("talker", url=broker.url) as node:
        node.create_publisher(String, "chatter", 7)
        node.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
        seen = await node.get_graph()
        assert await look(broker.url, Inspector.graph) == seen
        assert seen.nodes() == ["/talker"]


async def test_a_graph_of_many_pieces_is_whole(broker: Broker) -> None:
    """However many frames an answer takes."""
    async with actors.Node("talker", url=broker.url) as node:
        for number in range(1000):
            node.create_publisher(String, f"topic_number_{number}", 1)
        await until(lambda: broker.stats().endpoints > 1000)  # which takes longer than a query may
        seen = await node.get_graph()
        assert len((await look(broker.url, Inspector.graph)).entries) == len(seen.entries) > 1000


async def test_domains_are_apart(broker: Broker) -> None:
    """Only the graph that was asked for is seen."""
    async with actors.Node("talker", url=broker.url, domain=7):
        assert (await look(broker.url, Inspector.graph)).nodes() == []
        assert (await look(broker.url, Inspector.graph, domain=7)).nodes() == ["/talker"]


async def test_the_brokers_numbers(broker: Broker) -> None:
    """Two reports give rates."""

    def twice(inspector: Inspector) -> actors.BrokerReportRates:
        earlier = inspector.report()
        return inspector.report().rates_since(earlier)

    async with actors.Node("talker", url=broker.url) as node:
        publisher = node.create_publisher(String, "chatter", 1)
        publisher.publish(String(data="x"))
        await publisher.flush()
        report = await look(broker.url, Inspector.report)
        assert report.topics["/chatter"].messages == 1
        assert report.totals.connections == 2
        assert (await look(broker.url, twice)).topics["/chatter"]["messages"] == 0


async def test_definitions(broker: Broker) -> None:
    """What a node has declared can be read by its hash; what nobody has is None."""
    async with actors.Node("talker", url=broker.url) as node:
        await node.create_publisher(String, "chatter", 1).flush()
        found = await look(broker.url, lambda inspector: inspector.definition(type_hash(String)))
        assert found == definition(String)
        assert await look(broker.url, lambda inspector: inspector.definition("RIHS01_0")) is None


async def test_who_the_broker_is(broker: Broker) -> None:
    """The greeting says it, and takes a measurable time."""
    options, took = await look(broker.url, lambda inspector: (inspector.welcome, inspector.round_trip_sec))
    assert options["broker"] == broker.instance
    assert 0 < took < DEADLINE_SEC


async def test_the_first_broker_that_answers(broker: Broker, tmp_path: Path) -> None:
    """URLs are tried in order."""
    url = f"callboard+unix://{tmp_path}/nobody,{broker.url}"
    assert str(await look(url, lambda inspector: inspector.url)) == broker.url


async def test_a_broker_that_is_silent_leaves_time_for_the_next(
    broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each has an equal share of the time: half of it for the second of two, whatever the first does."""
    now, granted = [0.0], list[float]()
    stopped = SimpleNamespace(monotonic=lambda: now[0], time_ns=time.time_ns)
    monkeypatch.setattr(inspector_module, "time", stopped)

    def note(deadline: float) -> None:
        granted.append(deadline - now[0])
        now[0] += 20.0 * (len(granted) == 1)  # the first one uses up its share

    note_greetings(monkeypatch, note)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        url = f"callboard://127.0.0.1:{mute.getsockname()[1]},{broker.url}"
        assert str(await look(url, lambda inspector: inspector.url, timeout_sec=40.0)) == broker.url
    assert granted == [20.0, 20.0]


async def test_over_a_unix_socket(tmp_path: Path) -> None:
    """As over TCP."""
    async with Broker(BrokerOptions(unix=tmp_path / "s")) as running:
        assert (await look(running.url, Inspector.graph)).nodes() == []


def test_no_broker(tmp_path: Path) -> None:
    """The error names the places."""
    with pytest.raises(BrokerUnreachable, match="No broker at callboard\\+unix://"):
        Inspector(f"callboard+unix://{tmp_path}/nobody").connect()
    for host in ("a" * 70, "b..c", "ä..b", "ä" * 70):
        with pytest.raises(BrokerUnreachable, match="No broker at"):
            Inspector(f"callboard://{host}:1").connect()
    with pytest.raises(InvalidUrlError):
        Inspector("http://here")
    with pytest.raises(BrokerUnreachable, match="not connected"):
        Inspector("callboard://here").graph()


@contextmanager
def listener(*answers: bytes, stays: bool = True) -> Iterator[str]:
    """Something that answers one connection's reads with these bytes; then it is silent, or hangs up."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection, suppress(ConnectionResetError):  # an answer may come too late
                for answer in answers:
                    if not connection.recv(4096):
                        return
                    connection.sendall(answer)
                while connection.recv(4096) and stays:
                    pass

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"callboard://127.0.0.1:{server.getsockname()[1]}"
        thread.join()


WELCOME = encode(frames.Welcome(limits.PROTOCOL_VERSION, {}))


def test_a_broker_that_refuses() -> None:
    """Its reason is raised; one that this version does not know counts as internal."""
    for code, known in ((ErrorCode.SHUTDOWN, ErrorCode.SHUTDOWN), (99, ErrorCode.INTERNAL)):
        with (
            listener(encode(frames.Error(code, "no"))) as url,
            pytest.raises(ProtocolError, match="no") as caught,
        ):
            Inspector(url).connect()
        assert caught.value.code is known


@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\n", b"\xc6\xff\xff\xff\xff"])
def test_something_else_listens_there(answer: bytes) -> None:
    """It is no broker, and nothing large is read from it."""
    with listener(answer) as url, pytest.raises(ProtocolError):
        Inspector(url).connect()


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (b"", "No answer"),
        (encode(frames.Goodbye("bye")), "The link broke"),
        (encode(frames.Ping(1)), "No answer"),
    ],
)
def test_a_broker_that_does_not_answer(answer: bytes, text: str) -> None:
    """Every question ends in time, also when the broker says something else meanwhile."""
    with listener(WELCOME, answer) as url, Inspector(url, timeout_sec=50) as inspector:
        if text == "No answer":
            limit_questions(inspector, 0.1)
        with pytest.raises(BrokerUnreachable, match=text):
            inspector.graph()
        inspector.close()


def test_it_stays_connected_until_the_broker_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """It answers PINGs, for as long as there is a connection."""
    set_limits(monkeypatch, inspector_stay_sec=0.01)
    with listener(WELCOME + encode(frames.Ping(1)), encode(frames.Goodbye("bye"))) as url:
        inspector = Inspector(url)
        inspector.connect()
        inspector.stay_connected()
        with pytest.raises(BrokerUnreachable, match="not connected"):
            inspector.report()


def test_a_late_answer_is_not_taken_for_the_next_ones() -> None:
    """After a question without an answer in time the inspector asks nothing more."""
    with listener(WELCOME, b"") as url, Inspector(url, timeout_sec=50) as inspector:
        limit_questions(inspector, 0.1)
        with pytest.raises(BrokerUnreachable, match="No answer"):
            inspector.report()
        with pytest.raises(BrokerUnreachable, match="not connected"):
            inspector.report()


@pytest.mark.parametrize(("stays", "text"), [(True, "does not answer"), (False, "is no callboard broker")])
def test_what_takes_the_connection_and_does_not_greet(stays: bool, text: str) -> None:
    """The error differs from that of a free port: another program has the port, or a broker that hangs."""
    with listener(stays=stays) as url:
        inspector = Inspector(url, timeout_sec=1.0 if stays else 50.0)
        with pytest.raises(BrokerUnreachable, match=f"What listens at {url} {text}"):
            inspector.connect()
        assert str(inspector.listening) == url


def test_a_broker_that_hangs_up() -> None:
    """That is noticed at once."""
    with (
        listener(WELCOME, stays=False) as url,
        Inspector(url, timeout_sec=50) as inspector,
        pytest.raises(BrokerUnreachable, match="The link broke"),
    ):
        inspector.graph()


@pytest.mark.processes
def test_loads_no_event_loop() -> None:
    """It is for what must start fast."""
    code = (
        "import sys, actors.graph.inspector;"
        "sys.exit(bool({'asyncio', 'msgspec', 'actors.node.node'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=50)


async def test_the_brokers_clock_is_compared(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> None:
    """How far ahead it is, give or take the way there and back; None if it does not say."""

    def ahead(inspector: Inspector) -> tuple[float | None, float]:
        return inspector.clock_ahead_sec, inspector.round_trip_sec

    fast = SimpleNamespace(time_ns=lambda: time.time_ns() + 3600 * 10**9)
    monkeypatch.setattr(connection, "time", fast)
    found, round_trip = await look(broker.url, ahead)
    assert found == pytest.approx(3600.0, abs=round_trip + 1.0)
    monkeypatch.setattr(connection, "time", SimpleNamespace(time_ns=lambda: None))
    assert (await look(broker.url, ahead))[0] is None
