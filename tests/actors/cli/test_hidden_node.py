"""The hidden node: who it is, and what it says without a broker."""

from __future__ import annotations

import argparse
import socket
import socketserver
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from actors.cli.broker_target import missing_broker
from actors.cli.hidden_node import graph_of, hidden_node
from actors.cli.main import main
from actors.config.contexts import find_broker_target
from proto.wire.names import is_hidden
from proto.wire.url import parse_urls

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.actors.cli.conftest import Desk


@pytest.mark.parametrize(
    ("url", "remedy"),
    [
        ("callboard://127.0.0.1:7411", "Start one with: callboard broker"),
        ("callboard://localhost:9", "Start one with: callboard broker --port 9"),
        ("callboard://robot", "Start one there with: callboard broker --host robot --auth FILE"),
        ("callboard+unix:///tmp/x", "Start one with: callboard broker --unix /tmp/x"),
    ],
)
def test_a_missing_broker_has_a_remedy(url: str, remedy: str) -> None:
    """The command that would start one at that place."""
    assert missing_broker(find_broker_target(url)) == f"No broker at {parse_urls(url)[0]}. {remedy}"


def test_no_broker_is_one_line_and_3(capsys: pytest.CaptureFixture[str]) -> None:
    """No log line beside it, no traceback."""
    with socket.socket() as unheard:  # bound, so that nobody else takes the port; not listening
        unheard.bind(("127.0.0.1", 0))
        url = f"callboard://127.0.0.1:{unheard.getsockname()[1]}"
        assert main(["topic", "list", "--url", url]) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"No broker at {url}. Start one with: callboard broker --port ")
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize("verb", ["topic list", "topic echo /chatter", "doctor"])
def test_a_host_that_cannot_be_resolved_is_named(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    """The error does not suggest to start a broker there."""
    assert main([*verb.split(), "--url", "callboard://..:7411"]) in {1, 3}
    captured = capsys.readouterr()
    said = captured.out + captured.err
    assert "The host name '..' cannot be resolved" in said
    assert "Start one" not in said


def test_a_broker_that_says_nothing_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    """The wait for the handshake counts, too."""
    with socket.create_server(("127.0.0.1", 0)) as mute:
        assert main(["node", "list", "--url", f"callboard://127.0.0.1:{mute.getsockname()[1]}"]) == 3
    assert capsys.readouterr().err.endswith(" does not answer\n")


@contextmanager
def closing() -> Iterator[str]:
    """Something that takes connections and closes each as soon as something comes."""

    class Closes(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            self.request.recv(1)

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Closes) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,)).start()
        yield f"callboard://127.0.0.1:{server.server_address[1]}"
        server.shutdown()


@pytest.mark.parametrize("verb", [("topic", "list"), ("topic", "echo", "/x"), ("doctor",)])
def test_another_program_that_has_the_port_is_no_missing_broker(
    verb: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    """To start a broker there would fail, too: nobody says so."""
    with closing() as url:
        assert main([*verb, "--url", url]) == (1 if verb == ("doctor",) else 3)
        captured = capsys.readouterr()
        assert f"What listens at {url} is no callboard broker" in captured.out + captured.err
        assert "Start one" not in captured.out + captured.err


def test_a_bad_url_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    """It is named, with a right one."""
    assert main(["node", "list", "--url", "nonsense"]) == 2
    assert "'nonsense'" in capsys.readouterr().err


async def test_the_node_is_hidden_and_not_in_its_own_snapshot(desk: Desk) -> None:
    """Two commands in one process do not get in each other's way."""
    options = argparse.Namespace(url=desk.url, domain=None, context=None, own_process=False)
    async with hidden_node(options) as one, hidden_node(options) as two:
        assert is_hidden(one.get_fully_qualified_name())
        assert (await graph_of(one)).nodes() == [two.get_fully_qualified_name()]


async def test_domains_are_apart(desk: Desk) -> None:
    """--domain chooses the graph."""
    async with desk.node("far", domain=5, connect_timeout_sec=20.0):
        assert (await desk.callboard("node", "list")).out == ""
        assert (await desk.callboard("node", "list", "--domain", "5")).out == "/far\n"
