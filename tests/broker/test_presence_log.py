"""The broker's log lines about nodes that join, leave and die."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from broker import Broker, BrokerOptions
from proto import frames
from tests.broker import frame_makers as make
from tests.broker.rawclient import link, until

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
