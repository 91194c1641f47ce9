"""What tests of the player share: what subscriptions receive, and a player of a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actors.bags import BagTopic, Player, PlayerOptions, Writer
from actors.bags.player.player import EVERYTHING
from actors.interfaces.std_msgs.msg import Int32, String
from tests.actors.bags.bags import START_NS, number
from tests.actors.meeting import KEEP_ALL, Meeting, until

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from actors.bags import Selection
    from actors.qos.profile import QoSProfile


class Heard(NamedTuple):
    """A message that a subscription has received."""

    value: Any
    stamp_ns: int


async def listener(
    meeting: Meeting, topic: str, msg_type: Any = String, qos: QoSProfile = KEEP_ALL
) -> list[Heard]:
    """Return the list of what a new subscription receives."""
    heard: list[Heard] = []
    node = await meeting.node(f"listener{len(topic)}")
    node.create_subscription(
        msg_type, topic, lambda msg, info: heard.append(Heard(msg, info.source_timestamp)), qos
    )
    await node.get_graph()
    return heard


async def received(heard: list[Heard], count: int) -> None:
    """Wait until a subscription has received so many messages."""
    await until(lambda: len(heard) == count)


def player(
    meeting: Meeting, path: Path | Iterable[Path], selection: Selection | None = None, **options: Any
) -> Player:
    """Return a player of a bag, or of several."""
    return Player(path, selection or EVERYTHING, PlayerOptions(**options), url=meeting.url)


def numbers(path: Path, count: int, qos: QoSProfile, *, step_ns: int = 1, start_ns: int = START_NS) -> Path:
    """Write a bag of numbers on /count."""
    with Writer(path) as bag:
        topic = bag.add_topic(BagTopic.of_class("/count", Int32, [qos]))
        for index in range(count):
            time_ns = start_ns + index * step_ns
            bag.write(topic, number(index), time_ns, time_ns - 1, index)
    return path
