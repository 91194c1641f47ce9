"""The broker's log lines about nodes that join, leave and die."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from broker import Broker, BrokerOptions
from broker.routing.records import NodeRecord, Peer
from broker.serving.presence_log import MAX_LINES_PER_SEC, PresenceLog
from proto.wire import frames
from proto.wire.codes import EntryKind
from tests.broker import frame_makers as make
from tests.broker.rawclient import link, until
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    import pytest

LOGGER = "callboard.broker"
QUICK = BrokerOptions(port=0, drain_timeout_sec=0.2)


def verbose_broker() -> Broker:
    """Return a broker that logs nodes at info, as the daemon does."""
    return Broker(QUICK, node_log_level=logging.INFO)


def lines(caplog: pytest.LogCaptureFixture, level: int) -> list[str]:
    """Return what has been logged at this level."""
    return [record.getMessage() for record in caplog.records if record.levelno == level]


async def test_each_node_that_joins_or_leaves_is_one_line_at_info(caplog: pytest.LogCaptureFixture) -> None:
    """The line has its name, its address and the reason; it tells leaving from dying."""
    caplog.set_level(logging.INFO, LOGGER)
    async with verbose_broker() as broker:
        async with link(broker, "/talker", domain=3) as client:
            client.send(frames.Goodbye("stopped"))
            await client.gone()
        async with link(broker, "/listener"):
            pass
        await until(lambda: len(lines(caplog, logging.INFO)) == 4)
    joined, left, joined_too, died = lines(caplog, logging.INFO)
    assert joined.startswith("Node /talker joined (127.0.0.1:")
    assert joined.endswith(", domain 3)")
    assert left == joined.replace("joined", "left") + ": stopped"
    assert died.startswith(joined_too.replace("joined", "died") + ": connection lost")


async def test_a_node_that_ends_with_the_broker_has_left(caplog: pytest.LogCaptureFixture) -> None:
    """It has not died."""
    caplog.set_level(logging.INFO, LOGGER)
    async with verbose_broker() as broker, link(broker, "/talker"):
        await broker.stop()
    assert [line for line in lines(caplog, logging.INFO) if "left" in line and "is stopping" in line]


async def test_a_takeover_is_the_reason_why_the_first_node_left(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The same instance and token take over."""
    caplog.set_level(logging.INFO, LOGGER)
    same = {"instance": b"i" * 16, "token": b"t" * 16}
    async with (
        verbose_broker() as broker,
        link(broker, "/n", **same),
        link(broker, "/n", **same),
    ):
        assert [line for line in lines(caplog, logging.INFO) if "left" in line and "connected again" in line]


async def test_an_embedded_broker_logs_nodes_at_debug_only(caplog: pytest.LogCaptureFixture) -> None:
    """A program that embeds a broker prints nothing that it did not ask for."""
    caplog.set_level(logging.DEBUG, LOGGER)
    async with Broker(QUICK) as broker, link(broker, "/talker"):
        pass
    assert not lines(caplog, logging.INFO)
    debug = "\n".join(lines(caplog, logging.DEBUG))
    assert "Node /talker joined" in debug
    assert "Node /talker died" in debug or "Node /talker left" in debug


def test_a_flood_of_nodes_is_a_limited_number_of_lines(caplog: pytest.LogCaptureFixture) -> None:
    """At most so many; the others are counted in one line a second, until a second without a change."""
    caplog.set_level(logging.INFO, LOGGER)
    now = 0.0
    log = PresenceLog(logging.INFO, lambda: now)
    node = NodeRecord(key=1, id=0, peer=Peer(1), kind=EntryKind.NODE, node=None, name="/n")

    def log_changes(count: int) -> list[str]:
        caplog.clear()
        for _ in range(count):
            log.log_change(0, None, node, None)
        log.report_omitted()
        return lines(caplog, logging.INFO)

    assert len(log_changes(60)) == 60
    now = 0.5
    assert len(log_changes(60)) == MAX_LINES_PER_SEC - 60
    now = 0.99
    assert not log_changes(1000)
    now = 1.0
    (first,) = log_changes(100)
    assert first.startswith("… and 1020 more changes")
    now = 1.99
    assert not log_changes(0)
    now = 2.0
    (second,) = log_changes(0)
    assert second.startswith("… and 100 more changes")
    now = 3.0
    assert len(log_changes(60)) == 60


async def test_the_periodic_check_reports_what_was_left_out(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It needs no further change, once a second has passed."""
    set_limits(monkeypatch, log_lines_per_sec=1)
    caplog.set_level(logging.INFO, LOGGER)
    async with verbose_broker() as broker, link(broker, "/a") as client:
        joined = 1
        # Until one is left out: not the second, if the machine has paused for a second before it.
        while len(lines(caplog, logging.INFO)) == joined:
            client.send(frames.Node(joined, f"/b{joined}"))
            await client.synchronise()
            joined += 1
        await until(lambda: len(lines(caplog, logging.INFO)) == joined)
    assert lines(caplog, logging.INFO)[joined - 1].startswith("… and 1 more")


async def test_what_a_broker_left_out_of_its_log_is_counted_at_its_end(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing of it is lost. A check of the links may have reported a part."""
    set_limits(monkeypatch, log_lines_per_sec=2)
    caplog.set_level(logging.INFO, LOGGER)
    async with verbose_broker() as broker, link(broker, "/talker") as client:
        client.send(*(frames.Node(n, f"/n{n}") for n in range(1, 20)))  # too many for a pause to let all pass
        await client.synchronise()
        await broker.stop()
    texts = lines(caplog, logging.INFO)
    joined, left = [sum(verb in text for text in texts) for verb in (" joined ", " left ")]
    assert any(text.startswith("… and") for text in texts)
    assert joined + left + sum(int(text.split()[2]) for text in texts if text.startswith("…")) == 40


async def test_hidden_nodes_connections_and_declarations_are_logged_at_debug(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Commands do not fill the log."""
    caplog.set_level(logging.DEBUG, LOGGER)
    async with verbose_broker() as broker, link(broker, "/_cli") as client:
        client.send(make.publisher(1))
        await client.synchronise()
        client.send(frames.Undeclare(1))
        await client.synchronise()
    assert not lines(caplog, logging.INFO)
    said = "\n".join(lines(caplog, logging.DEBUG))
    for text in (
        "Connection from 127.0.0.1:",
        "Session opened: link 1",
        "Node /_cli joined",
        "Node /_cli declared the publisher /t",
        "Node /_cli removed the publisher /t",
    ):
        assert text in said
