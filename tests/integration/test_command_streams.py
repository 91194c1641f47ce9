"""Commands that continue until they are stopped, with real processes: signals and pipes."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.rcl_interfaces.msg import Log
from actors.qos.profile import qos_profile_rosout_default

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

TYPE = "std_msgs/msg/Header"


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (("hz", "/said"), "average rate: "),
        (("hz", "/said", "--subscribe"), "std dev: "),
        (("bw", "/said"), "Message size mean: "),
        (("bw", "/said", "--subscribe"), "Message size mean: "),
        (("echo", "/said", TYPE), "frame_id: map"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
async def test_ctrl_c_stops_commands_that_measure(
    system: System, command: tuple[str, ...], text: str
) -> None:
    """They exit with 130 at once, without a traceback; so does the publisher."""
    await system.broker()
    pub = await system.python("-m", "actors", "topic", "pub", "/said", TYPE, "frame_id: map", "-r", "100")
    await pub.wait_for_line("publishing #1:")
    program = await system.python("-m", "actors", "topic", *command)
    await program.wait_for_line(text)
    assert await program.stop() == 130
    assert await pub.stop() == 130
    assert "Traceback" not in program.output + pub.output


async def test_ctrl_c_stops_a_command_that_reads_stdin(system: System, tmp_path: Path) -> None:
    """It exits while stdin is silent, and has published all complete documents."""
    await system.broker()
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    writing = os.open(fifo, os.O_RDWR)
    try:
        script = f'exec "$0" -m actors topic pub --stdin /said {TYPE} <"$1"'
        pub = await system.program("sh", "-c", script, sys.executable, str(fifo))
        await pub.wait_for_line("beginning loop")
        os.write(writing, b"{frame_id: map, stamp: now}\n---\nframe_id: od")
        await pub.wait_for_line("publishing #1: std_msgs.msg.Header(")
        assert await pub.stop() == 130
    finally:
        os.close(writing)
    assert "Traceback" not in pub.output
    assert "#2" not in pub.output


async def test_an_echo_can_be_published_again(system: System) -> None:
    """`topic echo --json | topic pub --stdin` copies a topic; a closed pipe ends it without output."""
    await system.broker()
    command = '"$0" -m actors topic echo --json /said | "$0" -m actors topic pub --stdin /copy ' + TYPE
    pub = await system.python("-m", "actors", "topic", "pub", "/said", TYPE, "frame_id: map", "-r", "100")
    await pub.wait_for_line("publishing #1:")
    copy = await system.program("sh", "-c", command, sys.executable)
    await copy.wait_for_line("frame_id='map'")
    head = '"$0" -m actors topic echo /copy ' + TYPE + " | head -n 3"
    first = await system.program("sh", "-c", head, sys.executable)
    assert await first.wait_for_exit() == 0
    assert first.lines == ["stamp:", "  sec: 0", "  nanosec: 0"]


async def test_the_log_is_followed_across_a_restart_of_the_broker(system: System) -> None:
    """No line is printed twice or missed; Ctrl-C ends it with 130, a closed pipe when it prints."""
    broker = await system.broker()
    async with actors.Node("a", url=system.url) as node:
        publisher = node.create_publisher(Log, "/rosout", qos_profile_rosout_default)
        publisher.publish(Log(msg="one"))
        await publisher.flush(20)
        log = await system.python("-m", "actors", "log", "--follow")
        await log.wait_for_line("one")
        await broker.kill()
        await log.wait_for_line("No broker at")
        publisher.publish(Log(msg="two"))
        await system.broker()
        await log.wait_for_line("two")
        publisher.publish(Log(msg="three"))
        await log.wait_for_line("three")
        assert await log.stop() == 130
        node.create_timer(0.05, lambda: publisher.publish(Log(msg="four")))
        head = '"$0" -m actors log --follow | head -n 1'
        first = await system.program("sh", "-c", head, sys.executable)
        assert await first.wait_for_exit() == 0
    assert [line.rpartition(" ")[2] for line in log.lines if "[0.0" in line] == ["one", "two", "three"]
    assert "Traceback" not in log.output + first.output
