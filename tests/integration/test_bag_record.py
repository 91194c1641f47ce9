"""`callboard bag record` as a process: signals, keys, and a disk that is full."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, Final

import pytest

import actors
from actors.interfaces.std_msgs.msg import String
from tests.actors.bags.recorder.recordings import messages_of
from tests.integration.conftest import wait_for_subscriptions
from tests.integration.terminal import on_terminal
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

FULL: Final = """\
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
from actors.cli.main import main
sys.exit(main())
"""
"""callboard with files of at most 100,000 bytes: what a full disk is like, without filling one."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_completes_the_bag(system: System, tmp_path: Path, number: signal.Signals) -> None:
    """What had arrived is in the bag, the last line says how much, and the exit code is 0."""
    bag = tmp_path / "trip"
    await system.broker()
    record = await system.python("-m", "actors", "bag", "record", "/chatter", "-o", str(bag))
    await record.wait_for_line(f"Recording into {bag}")
    async with actors.Node("talker", url=system.url) as node:
        talker = node.create_publisher(String, "/chatter", 10)
        await wait_for_subscriptions(talker)
        talker.publish(String(data="hello"))
        await until(lambda: b"hello" in (bag / "trip_0.mcap").read_bytes(), "the message in the file")
    record.send_signal(number)
    assert await record.wait_for_exit() == 0
    assert record.lines[-1] == f"{bag}: 1 message of 1 topic"
    assert [each.decoded(String).data for each in messages_of(bag)] == ["hello"]
    assert (bag / "metadata.yaml").exists()


async def test_the_space_key_pauses(system: System, tmp_path: Path) -> None:
    """And resumes; the terminal is as before at the end."""
    await system.broker()
    bag = str(tmp_path / "trip")
    arguments = ("bag", "record", "/chatter", "-o", bag, "--url", system.url)
    async with on_terminal(*arguments, term="dumb") as terminal:
        await terminal.wait_for_text(f"Recording into {bag}")
        for text in ("Pausing recording", "Resuming recording"):
            terminal.type_keys(b" ")
            await terminal.wait_for_text(text)
        terminal.process.send_signal(signal.SIGINT)
        assert await terminal.wait_for_exit() == 0
        assert terminal.settings == terminal.before


async def test_a_full_disk(system: System, tmp_path: Path) -> None:
    """Case 42: it ends with one line and a valid bag, and says what is missing."""
    bag = tmp_path / "trip"
    await system.broker()
    record = await system.python("-c", FULL, "bag", "record", "/chatter", "-o", str(bag), forked=False)
    await record.wait_for_line(f"Recording into {bag}")
    async with actors.Node("talker", url=system.url) as node:
        talker = node.create_publisher(String, "/chatter", 1000)
        await wait_for_subscriptions(talker)
        for index in range(300):
            talker.publish(String(data=f"{index} {'x' * 1000}"))
        assert await record.wait_for_exit() == 1
    errors = [line for line in record.lines if "the disk is full" in line]
    assert len(errors) == 1, record.output
    assert "Traceback" not in record.output
    assert (bag / "metadata.yaml").exists()
    numbers = [int(each.decoded(String).data.split()[0]) for each in messages_of(bag)]
    assert numbers == list(range(len(numbers)))
    assert len(numbers) < 300
    assert any(line.startswith(f"{bag}: {len(numbers)} message") for line in record.lines), record.output
