"""Several bags that are played at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.bags import Order, Writer
from actors.bags.errors import BagError
from actors.bags.player.bag_source import BagSource
from actors.bags.player.player import EVERYTHING
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.profile import QoSProfile
from tests.actors.bags.bags import CHATTER, COUNT, START_NS, number, text
from tests.actors.bags.player.playing import listener, numbers, player, received

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting

SEC = 10**9


async def test_they_are_merged_by_time(meeting: Meeting, tmp_path: Path) -> None:
    """From the earliest message of all to the latest one; a topic of both has one publisher."""
    late = numbers(tmp_path / "late", 3, QoSProfile(depth=10), step_ns=2, start_ns=START_NS + 1)
    early = numbers(tmp_path / "early", 3, QoSProfile(depth=10), step_ns=2)
    heard = await listener(meeting, "/count", Int32)
    async with player(meeting, [late, early]) as playing:
        await playing.wait()
        await received(heard, 6)
        found = playing.statistics()
    assert [each.value.data for each in heard] == [0, 0, 1, 1, 2, 2]
    assert [each.stamp_ns - START_NS for each in heard] == [-1, 0, 1, 2, 3, 4]
    assert (found.start_ns, found.end_ns) == (START_NS, START_NS + 5)
    assert found.topics == {"/count": 6}


def sources(*paths: Path, order: Order = Order.LOG) -> BagSource:
    """Return bags, all of whose topics are read."""
    source = BagSource(paths, EVERYTHING, frozenset(), order)
    for topic in source.topics:
        topic.publisher = object()  # type: ignore[assignment] # it is read if it would be published
    return source


@pytest.mark.parametrize("order", [Order.LOG, Order.PUBLISH])
def test_messages_of_the_same_time(tmp_path: Path, order: Order) -> None:
    """As in the file, whatever their topics, and the bag that was named first comes first."""
    for name in ("b", "a"):
        with Writer(tmp_path / name, chunk_size=100) as bag:
            topics = [bag.add_topic(CHATTER), bag.add_topic(COUNT)]
            for index in range(20):
                data = [text(f"{name} {index}"), number(index)][index % 3 % 2]
                bag.write(topics[index % 3 % 2], data, START_NS, START_NS)
    source = sources(tmp_path / "b", tmp_path / "a", order=order)
    names = [each.topic.name for each in source.messages(None)]
    source.close()
    assert names == [("/chatter", "/count")[index % 3 % 2] for index in range(20)] * 2


def test_empty_ones(tmp_path: Path) -> None:
    """A bag without messages adds nothing; if all are, there is nothing to play."""
    with Writer(tmp_path / "empty") as bag:
        bag.add_topic(COUNT)
    full = numbers(tmp_path / "full", 2, QoSProfile(depth=10))
    source = sources(tmp_path / "empty", full)
    assert (source.start_ns, len(list(source.messages(None)))) == (START_NS, 2)
    source.close()
    with pytest.raises(BagError, match="have no messages"):
        sources(tmp_path / "empty", tmp_path / "empty")
