"""Logging during faults: a reader of `/rosout` gets each line once and in order, and logging goes on."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.rcl_interfaces.msg import Log
from actors.qos.profile import qos_profile_rosout_default
from tests.simulation.network import BROKER
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import Any

    import actors


class Diary:
    """A node that logs a number in each tick, and the numbers that another node has read."""

    def __init__(self, writer: actors.Node, reader: actors.Node) -> None:
        self.written = 0
        self.read: list[int] = []
        self._log = writer.get_logger()
        self._timer = writer.create_timer(0.01, self._write)
        reader.create_subscription(Log, "/rosout", self._on_line, qos_profile_rosout_default)

    def _write(self) -> None:
        for _ in range(3):
            self._log.info(f"line {self.written}")
            self.written += 1

    def _on_line(self, line: Log) -> None:
        if line.msg.startswith("line "):  # not what the node says about its link
            self.read.append(int(line.msg.removeprefix("line ")))

    def stop(self) -> None:
        """Write no more."""
        self._timer.cancel()


async def _crash(stage: Stage) -> None:
    await stage.crash_broker()
    await asyncio.sleep(1)
    await stage.start_broker()


async def _cut_writer(stage: Stage) -> None:
    stage.network.drop("writer")


async def _cut_reader(stage: Stage) -> None:
    stage.network.drop("reader")


async def _silence_writer(stage: Stage) -> None:
    stage.network.block("writer", BROKER)
    await asyncio.sleep(2)
    stage.network.heal()


@pytest.mark.parametrize("fault", [_crash, _cut_writer, _cut_reader, _silence_writer])
@pytest.mark.parametrize("seed", range(3))
def test_each_line_is_read_once_and_in_order(
    fault: Callable[[Stage], Coroutine[Any, Any, None]], seed: int
) -> None:
    """Fewer lines than the depth are written meanwhile, so none is lost."""

    async def scene(stage: Stage) -> None:
        writer = await stage.enter("writer", enable_rosout=True)
        diary = Diary(writer, await stage.enter("reader"))
        await stage.until(lambda: len(diary.read) > 50)
        await fault(stage)
        await stage.until(lambda: len(diary.read) > 300)
        diary.stop()
        await stage.until(lambda: len(diary.read) == diary.written)
        assert diary.read == list(range(diary.written))

    play(scene, seed)


def test_a_long_silence_keeps_the_newest_lines_and_counts_the_rest() -> None:
    """Without a broker the node keeps as many lines as the depth; the others are in its diagnostics."""

    async def scene(stage: Stage) -> None:
        writer = await stage.enter("writer", enable_rosout=True)
        diary = Diary(writer, await stage.enter("reader"))
        await stage.until(lambda: len(diary.read) > 50)
        await stage.crash_broker()
        await stage.until(lambda: diary.written > 2000)
        diary.stop()
        await stage.start_broker()
        await stage.until(lambda: diary.read[-1:] == [diary.written - 1])
        missing = diary.written - len(diary.read)
        (rosout,) = [each for each in writer.diagnostics().publishers if each.topic == "/rosout"]
        assert diary.read == sorted(set(diary.read))
        assert missing > 0
        assert abs(rosout.dropped - missing) <= 10  # its lines about the link; some were on their way

    play(scene)


def test_the_broker_keeps_no_expired_lines() -> None:
    """Those of a node that logs nothing more free their memory in the broker."""

    async def scene(stage: Stage) -> None:
        writer = await stage.enter("writer", enable_rosout=True)
        for number in range(100):
            writer.get_logger().info(f"line {number}")
        await stage.until(lambda: stage.broker.stats().latched >= 100)
        await asyncio.sleep(9)
        assert stage.broker.stats().latched >= 100
        await asyncio.sleep(60)
        assert stage.broker.stats().latched_bytes == 0

    play(scene)
