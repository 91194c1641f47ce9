"""`callboard demo`: what it prints, and how it ends."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import re
import signal
import socket
import sys
from typing import NoReturn

import pytest

from actors.cli.commands.demo import _Labels
from actors.cli.main import main
from tests.fork_server.client import FORKED


def test_the_demo_talks_and_sums_up(capsys: pytest.CaptureFixture[str]) -> None:
    """Every node says its lines under its label; without a terminal there is no colour."""
    level = logging.getLogger("callboard").level
    assert main(["demo", "--seconds", "3"]) == 0
    out = capsys.readouterr().out
    for line in (
        r'minimal_publisher +\| Publishing: "Hi Automatic Addison: 0"',
        r'minimal_subscriber +\| I heard: "Hi Automatic Addison: \d+"',
        r"publishing_subscriber +\| I heard Hi Automatic Addison: \d+",
        r"add_two_ints_server +\| Incoming request: 5 \+ 3",
        r"add_two_ints_client +\| Sum: 8",
        r"\d+ messages sent, \d+ heard; \d+ service calls, p50 \d+\.\d\d ms\.",
    ):
        assert re.search(f"^{line}$", out, re.MULTILINE), line
    assert "\x1b" not in out
    assert logging.getLogger("callboard").level == level


def test_the_demo_does_without_a_network(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the loopback device is down, a unix socket stands in."""

    def unreachable(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.ENETUNREACH, "Network is unreachable")

    monkeypatch.setattr(socket, "create_connection", unreachable)
    assert main(["demo", "--seconds", "3"]) == 0
    out = capsys.readouterr().out
    assert "A broker at callboard+unix://" in out
    assert "| Sum: 8\n" in out


def test_labels_have_colours_of_their_own() -> None:
    """Each line of a message has label and colour; what steers a terminal is escaped."""
    record = logging.makeLogRecord(
        {"name": "callboard.minimal_publisher", "levelno": 20, "msg": "one\ntwo \x1b[2J"}
    )
    assert _Labels(color=True).format(record).splitlines() == [
        "\x1b[32mminimal_publisher     | one\x1b[0m",
        "\x1b[32mminimal_publisher     | two \\x1b[2J\x1b[0m",
    ]


async def _start() -> asyncio.subprocess.Process:
    """Start the demo as a user would, with a broker's address that leads nowhere in the environment."""
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "demo", "--seconds", "600"),
        executable=FORKED,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env=os.environ | {"CALLBOARD_URL": "callboard://127.0.0.1:1", "NO_COLOR": "1"},
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
@pytest.mark.processes
async def test_a_signal_ends_the_demo_cleanly(number: signal.Signals) -> None:
    """In the middle of the talk: the summary, 0, nothing on stderr."""
    process = await _start()
    assert process.stdout is not None
    async with asyncio.timeout(50):
        while b"Sum: 8" not in await process.stdout.readline():
            pass
        process.send_signal(number)
        out, err = await process.communicate()
    assert (process.returncode, err) == (0, b"")
    assert re.search(rb"messages sent, \d+ heard; \d+ service calls, p50", out)
