"""`callboard bag play` on a terminal: keys, and the line with the position."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from actors.bags import BagTopic, Writer
from actors.interfaces.std_msgs.msg import Int32
from tests.actors.bags.bags import START_NS, number
from tests.integration.terminal import on_terminal

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System


async def test_keys_control_it(system: System, tmp_path: Path) -> None:
    """Pausing, a single message, the rate, and Ctrl-C; a line shows where it is."""
    await system.broker()
    with Writer(tmp_path / "trip") as bag:
        topic = bag.add_topic(BagTopic.of_class("/count", Int32))
        for index in range(3):
            time_ns = START_NS + index * 3600 * 10**9
            bag.write(topic, number(index), time_ns, time_ns)
    arguments = ("bag", "play", str(tmp_path / "trip"), "--url", system.url)
    async with on_terminal(*arguments, term="xterm") as terminal:
        await terminal.wait_for_text("of 7200.0 s, rate 1, 1 messages, 0 dropped")
        terminal.type_keys(b" ")
        await terminal.wait_for_text("0 dropped, paused")
        terminal.type_keys(b"\x1b[C")
        await terminal.wait_for_text("3600.0 of 7200.0 s, rate 1, 2 messages, 0 dropped, paused")
        terminal.type_keys(b"\x1b[A")
        await terminal.wait_for_text("rate 1.1, ")
        terminal.process.send_signal(signal.SIGINT)
        await terminal.wait_for_text("2 messages of 1 topic")
        assert await terminal.wait_for_exit() == 0
        assert terminal.settings == terminal.before
