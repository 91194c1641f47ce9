"""Queries end in time and within bounds, whatever the broker sends."""

from __future__ import annotations

import asyncio
import re
import socket
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import pytest

import actors
from actors.cli.main import main
from actors.errors import BrokerUnreachable
from actors.graph import inspector as inspector_module
from actors.graph import snapshot as snapshot_module
from actors.graph.broker_report import ReportParts
from actors.graph.inspector import Inspector
from actors.graph.snapshot import GraphSnapshot
from proto import limits
from proto.errors import ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from tests.broker.rawclient import DEADLINE_SEC, read_frame
from tests.seams.nodes import queries_of
from tests.system import stop_inspectors
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

WELCOME = encode(frames.Welcome(limits.PROTOCOL_VERSION, {}))
ENTRIES = tuple(frames.GraphEntry(key, 0, f"/n{key}", f"/n{key}", "", "", {}) for key in range(100))


@contextmanager
def endless(frame: frames.Frame, answered: Callable[[], object] = bool) -> Iterator[str]:
    """A broker that answers a query with the same frame until the client closes.

    Args:
        frame: The answer.
        answered: Called when the first answers have been written.
    """
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):  # the client closes
                connection.recv(4096)
                connection.sendall(WELCOME)
                connection.recv(4096)
                connection.sendall(encode(frame) * 20)
                answered()
                while True:
                    connection.sendall(encode(frame) * 20)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"callboard://127.0.0.1:{server.getsockname()[1]}"
        thread.join()


@pytest.mark.parametrize(
    ("frame", "query"),
    [
        (frames.Graph(1, True, ENTRIES, (), ()), Inspector.graph),
        (frames.Stats(1, True, {}, (), ()), Inspector.report),
        (frames.Definition("other", b"x"), lambda inspector: inspector.definition("RIHS01_0")),
        (frames.Ping(1), Inspector.graph),
    ],
)
def test_an_answer_without_an_end_ends_at_the_deadline(
    frame: frames.Frame, query: Callable[[Inspector], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 58: the time is for the whole answer, not for each frame."""
    with (
        endless(frame, stop_inspectors(monkeypatch)) as url,
        Inspector(url, timeout_sec=DEADLINE_SEC) as inspector,
        pytest.raises(BrokerUnreachable, match=r"No (complete )?answer from the broker at"),
    ):
        query(inspector)


@pytest.mark.parametrize("verb", [("topic", "list"), ("node", "list"), ("graph",)])
def test_commands_end_with_the_code_for_no_broker(
    verb: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Case 58: `topic list` of a broker that never finishes its answer exits with 3."""
    with endless(frames.Graph(1, True, ENTRIES, (), ()), stop_inspectors(monkeypatch)) as url:
        assert main([*verb, "--url", url]) == 3
    assert re.match(r"No (complete )?answer from the broker", capsys.readouterr().err)


def test_an_answer_is_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 58: a fast broker cannot fill the memory before the deadline."""
    monkeypatch.setattr(inspector_module, "MAX_ANSWER_BYTES", 100_000)
    with (
        endless(frames.Graph(1, True, ENTRIES, (), ())) as url,
        Inspector(url, timeout_sec=60) as inspector,
        pytest.raises(ProtocolError, match="more than 100000 bytes"),
    ):
        inspector.graph()


def test_a_graph_and_a_report_are_bounded_in_entries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 58: those of a node's watch, too, which lasts as long as the node."""
    monkeypatch.setattr(snapshot_module, "MAX_ENTRIES", 150)
    snapshot, more = GraphSnapshot(), tuple(entry._replace(key=entry.key + 100) for entry in ENTRIES)
    snapshot.apply(frames.Graph(1, True, ENTRIES, (), ()))
    snapshot.apply(frames.Graph(1, True, ENTRIES, (), ()))  # the same entries again
    with pytest.raises(ProtocolError, match="more than 150 entries"):
        snapshot.apply(frames.Graph(1, True, more, (), ()))
    with pytest.raises(ProtocolError, match="more than 150 entries"):
        ReportParts().add(frames.Stats(1, True, {str(key): key for key in range(151)}, (), ()))


async def test_a_nodes_query_without_an_end_ends_at_its_deadline() -> None:
    """Case 58: waiting for a session and for the whole answer share one time; the node goes on."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(ConnectionError, asyncio.IncompleteReadError):
            while True:
                frame = await read_frame(reader)
                if isinstance(frame, frames.Hello):
                    writer.write(WELCOME)
                elif isinstance(frame, frames.Node):
                    writer.write(encode(frames.Accepted(frame.id, 0)))
                elif isinstance(frame, frames.Watch):
                    endless = encode(frames.Graph(frame.id, True, ENTRIES, (), ()))
                    while not writer.is_closing():
                        writer.write(endless)
                        await writer.drain()
                        await asyncio.sleep(0)
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    url = f"callboard://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    async with server, actors.Node("n", url=url, stop_timeout_sec=0) as node:
        await until(lambda: node.connected)
        loop = asyncio.get_running_loop()
        began = loop.time()
        with pytest.raises(BrokerUnreachable, match="No answer from the broker"):
            await queries_of(node).snapshot(0.2)
        assert loop.time() - began < DEADLINE_SEC
        assert node.connected
