"""When a broker that ends by itself has been idle for long enough, and that its process then ends."""

from __future__ import annotations

import asyncio

import pytest

from broker.daemon.idleness import CHECKS, Idleness
from broker.errors import InvalidOptionError
from broker.options import DaemonOptions
from proto.wire import frames
from proto.wire.stats import BrokerStats
from proto.wire.url import parse_url
from tests.broker.daemon.test_command import end, first_line, started
from tests.broker.rawclient import GREETING_BYTES, read_frame


def at(stamp_sec: float, connections: int = 0, bytes_received: int = 0) -> BrokerStats:
    """Return a broker's statistics at a time."""
    return BrokerStats(stamp_sec=stamp_sec, connections=connections, bytes_received=bytes_received)


def test_the_time_counts_from_the_start_and_from_the_last_client() -> None:
    """Without a client it is over after the limit; a client stops the count, and its end starts it again."""
    assert Idleness(8.0, at(100)).period_sec == 8.0 / CHECKS
    assert not Idleness(8.0, at(100)).is_over(at(107.9))
    assert Idleness(8.0, at(100)).is_over(at(108))
    idleness = Idleness(8.0, at(100))
    assert [idleness.is_over(at(now, 1, 50)) for now in (107, 115, 200)] == [False] * 3
    assert not idleness.is_over(at(207.9, 0, 50))
    assert idleness.is_over(at(208, 0, 50))


def test_a_client_between_two_checks_counts() -> None:
    """Its bytes show that it was there, although it is gone."""
    idleness = Idleness(8.0, at(100))
    assert not idleness.is_over(at(107, 0, 50))
    assert not idleness.is_over(at(114.9, 0, 50))
    assert idleness.is_over(at(115, 0, 50))


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), 86_401])
def test_the_time_has_a_range(seconds: float) -> None:
    """An idle broker ends after some time, and not at once."""
    with pytest.raises(InvalidOptionError, match=r"^exit_when_idle must be from 0\.1 to 86400, got"):
        DaemonOptions(exit_when_idle=seconds)


@pytest.mark.processes
async def test_an_idle_process_ends_with_0_and_says_so() -> None:
    """It runs as long as a client is connected, even beyond the limit, and ends when there is none."""
    options = ("--port", "0", "--exit-when-idle", "2", "--keepalive-sec", "6", "--idle-keepalive-sec", "6")
    async with started(*options) as process:
        url = parse_url(await first_line(process))
        reader, writer = await asyncio.open_connection(url.host, url.port)
        writer.write(GREETING_BYTES)
        async with asyncio.timeout(20):
            while not isinstance(await read_frame(reader), frames.Ping):  # of a link silent for 3 s
                pass
        writer.close()
        code, _out, err = await end(process)
    assert code == 0
    assert "[INFO]" in err
    assert "No client has been connected for 2 s: the broker ends" in err
