"""The log of a program on `/rosout`, with its switches on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import actors
from actors.interfaces.rcl_interfaces.msg import Log
from actors.qos.profile import qos_profile_rosout_default
from tests.actors.meeting import BARE, DEADLINE_SEC

if TYPE_CHECKING:
    from tests.integration.conftest import System


async def test_lines_that_are_not_printed_are_published(system: System) -> None:
    """--disable-stdout-logs silences the terminal only: the place in the program's file comes along."""
    await system.broker()
    talker = await system.example("minimal_publisher", "--ros-args", "--disable-stdout-logs")
    async with actors.Node("reader", url=system.url, use_global_arguments=False, **BARE) as node:
        line = await actors.wait_for_message(
            Log, node, "/rosout", qos_profile=qos_profile_rosout_default, timeout_sec=DEADLINE_SEC
        )
    assert (line.name, line.level) == ("minimal_publisher", Log.INFO)
    assert line.msg.startswith('Publishing: "Hi Automatic Addison: ')
    assert line.file.endswith("examples/minimal_publisher.py")
    assert line.function == "on_timer"
    assert await talker.stop() == 0
    assert talker.output == ""


async def test_lines_that_are_not_published_are_printed(system: System) -> None:
    """With --disable-rosout-logs there is no topic, and the lines are printed."""
    await system.broker()
    talker = await system.example("minimal_publisher", "--ros-args", "--disable-rosout-logs")
    await talker.wait_for_line("Publishing")
    async with actors.Node("reader", url=system.url, use_global_arguments=False, **BARE) as node:
        topics = [name for name, _ in await node.get_topic_names_and_types()]
    assert topics == ["/addison", "/parameter_events"]
