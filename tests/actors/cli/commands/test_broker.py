"""`callboard broker`: the daemon behind it, and its end."""

from __future__ import annotations

import asyncio
import signal
import sys

import pytest

from actors.cli.main import main


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
async def test_a_signal_ends_the_broker_cleanly(number: signal.Signals) -> None:
    """It says where it listens; stopped, it ends with 0 and without a traceback."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "broker", "--port", "0"),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    async with asyncio.timeout(50):
        assert (await process.stdout.readline()).startswith(b"callboard broker listening on callboard://127.")
        process.send_signal(number)
        _, err = await process.communicate()
    assert process.returncode == 0
    assert b"Traceback" not in err


def test_wrong_flags_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """The daemon's flags go through the command line's parser."""
    assert main(["broker", "--prt", "1"]) == 2
    assert capsys.readouterr().err == (
        "callboard broker: unrecognized arguments: --prt; see callboard broker --help\n"
    )
