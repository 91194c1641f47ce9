"""Texts of peers: few, short and honest lines in the logs of a broker and of a node."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import msgpack
import pytest

import actors
from actors.endpoints.client import endpoint as client_endpoint
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.std_msgs.msg import String
from actors.session.dispatch import DISPATCH
from broker import Broker, BrokerOptions
from proto import limits
from proto.errors import ErrorCode
from proto.limited_log import MAX_LINES
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.codes import NoticeKind
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.rawclient import link, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

pytestmark = pytest.mark.usefixtures("patience")

HOSTILE = "\x1b[2J\nNode /forged joined\x00" * 400
CLEAN = "日本語, ünicode and €"


@pytest.fixture
async def broker() -> AsyncIterator[Broker]:
    """A broker on a free port."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as running:
        yield running


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return the warnings logged so far."""
    return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]


@pytest.mark.parametrize("text", [HOSTILE, "\n" * 500, "\U000e0001" * 400, "a" * 501, "\x1b", "\ud800"])
def test_a_text_of_a_peer_is_one_short_line(text: str) -> None:
    """Case 56: escaped first and cut then, so that escapes do not make it long."""
    shown = peer_text(text)
    assert shown.isprintable()
    assert len(shown) <= limits.MAX_ERROR_TEXT
    assert peer_text(shown) == shown


def test_a_clean_text_stays_as_it_is() -> None:
    """Case 56: in any language."""
    assert peer_text(CLEAN) == CLEAN
    assert peer_text("x" * 500) == "x" * 500


async def test_errors_of_clients_are_few_short_lines(
    broker: Broker, caplog: pytest.LogCaptureFixture
) -> None:
    """Cases 20 and 56: 30 links that end with hostile ERRORs are 10 lines, and a sum when the broker ends."""
    for _ in range(30):
        async with link(broker) as client:
            client.send(frames.Error(ErrorCode.INTERNAL, HOSTILE[:500]))
            await client.gone()
    await broker.stop()
    *lines, last = warnings(caplog)
    assert len(lines) == MAX_LINES
    assert last == "… and 20 more like this: links closed by their clients"
    assert all(line.isprintable() and len(line) < 700 for line in lines)


async def test_violations_are_few_lines_of_each_kind(
    broker: Broker, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 56: a client that is closed again and again does not fill the log."""
    for _ in range(30):
        async with link(broker) as client:
            client.send(frames.Unwatch(1), frames.Watch(1, keep=True), frames.Watch(1, keep=True))
            await client.gone()
    await broker.stop()
    lines = warnings(caplog)
    assert len(lines) == MAX_LINES + 1
    assert lines[-1].startswith("… and 20 more like this: links closed with UNEXPECTED")


async def test_declarations_beyond_a_limit_are_few_lines(caplog: pytest.LogCaptureFixture) -> None:
    """Case 57: who declares too much is named in the log, with the limit."""
    options = BrokerOptions(port=0, max_definitions=1, drain_timeout_sec=0.2)
    async with Broker(options) as broker, link(broker, "/junk") as client:
        for number in range(1, 32):
            definition = b"junk %d" % number
            declared = make.publisher(number, type_hash=hash_of(definition))
            client.send(declared._replace(definition=definition))
        await client.synchronise()
        assert broker.stats().refused_definitions == 30
    lines = warnings(caplog)
    assert "Refused declarations and watches of link 1 " in lines[0]
    assert "--max-definitions" in lines[0]
    assert lines[MAX_LINES:] == ["… and 20 more like this: refused declarations and watches"]


async def test_mismatched_types_are_few_warnings_at_an_innocent_node(
    broker: Broker, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 56: ten lines, and a sum when the node ends at the latest; the events still count all of them."""

    def lines() -> list[str]:
        return [each.getMessage() for each in caplog.records if each.name == "callboard.innocent"]

    async with actors.Node("innocent", url=broker.url) as node, link(broker, "/guilty") as guilty:
        mismatches: list[int] = []
        counted = actors.SubscriptionEventCallbacks(
            incompatible_type=lambda info: mismatches.append(info.total_count)
        )
        node.create_subscription(String, "a", lambda msg: None, event_callbacks=counted)
        node.create_subscription(String, "b", lambda msg: None)
        await node.get_graph()
        for number in range(1, 31):
            for id_, topic in ((number, "/a"), (number + 100, "/b")):
                guilty.send(make.publisher(id_, topic, type_hash="RIHS01_other"))
        await until(lambda: mismatches and mismatches[-1] == 30)
        await node.get_graph()
        assert len(lines()) == MAX_LINES
    assert lines()[MAX_LINES:] == ["… and 20 more like this: INCOMPATIBLE_TYPE notices"]


async def test_refusals_are_few_lines_at_a_node(broker: Broker, caplog: pytest.LogCaptureFixture) -> None:
    """Case 56: a broker that refuses without an end, or for access rules, does not fill the log either."""
    async with actors.Node("refused", url=broker.url) as node:
        endpoint = endpoint_of(node.create_subscription(String, "a", lambda msg: None))
        for _ in range(30):
            endpoint.refused(ErrorCode.LIMIT, "no")
    lines = [each.getMessage() for each in caplog.records if each.name == "callboard.refused"]
    assert lines[:MAX_LINES] == ["The broker refused a subscription: no"] * MAX_LINES
    assert lines[MAX_LINES:] == ["… and 20 more like this: refusals of the broker"]


def test_texts_of_a_broker_are_escaped_where_they_arrive() -> None:
    """Case 56: in exceptions and logs alike."""
    seen: list[object] = []

    class Endpoint:
        owns_link = True

        def refused(self, code: int, text: str) -> None:
            seen.append(text)

        def notice(self, notice: frames.Notice) -> None:
            seen.append(notice.text)

    class Link:
        endpoints = {1: Endpoint()}  # noqa: RUF012

    class Connection:
        def name_taken(self, text: str) -> None:
            seen.append(text)

    for frame in (
        frames.Refused(1, ErrorCode.LIMIT, HOSTILE),
        frames.Refused(1, ErrorCode.NAME_TAKEN, HOSTILE),
        frames.Notice(1, NoticeKind.INCOMPATIBLE_TYPE, HOSTILE, 0, 1),
    ):
        DISPATCH[type(frame)](Connection(), Link(), frame)  # type: ignore[arg-type]
    assert seen == [peer_text(HOSTILE)] * 3


def test_errors_of_servers_are_one_short_line() -> None:
    """Case 56: type and text of a RemoteError, also if a foreign server sends something else."""
    text = peer_text(HOSTILE)
    assert client_endpoint.remote_error(msgpack.packb([HOSTILE, HOSTILE])) == (text, text)
    nested = b"\x91" * 400 + b"\x01"
    assert len(client_endpoint.remote_error(b"\x92" + nested + nested)[1]) == limits.MAX_ERROR_TEXT
