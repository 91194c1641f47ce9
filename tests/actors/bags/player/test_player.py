"""The node that plays, against a broker and subscriptions in the test's loop."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest

from actors.bags import BagTopic, Order, PlayerOptions, Reader, Recorder, Selection, Writer
from actors.bags.errors import BagError, BagNotFoundError, InvalidBagOptionError
from actors.bags.player import bag_source
from actors.bags.player.bag_source import BagSource
from actors.interfaces import cdr
from actors.interfaces.builtin_interfaces.msg import Duration, Time
from actors.interfaces.rosbag2_interfaces.msg import ReadSplitEvent
from actors.interfaces.rosbag2_interfaces.srv import (
    Burst,
    GetRate,
    IsPaused,
    Pause,
    Play,
    PlayNext,
    Resume,
    Seek,
    SetRate,
    Stop,
    TogglePaused,
)
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Empty, Int32, String
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from proto.wire.codes import EntryKind
from tests.actors.bags.bags import COUNT, START_NS, number, text, write_bag
from tests.actors.bags.player.playing import listener, numbers, player, received
from tests.actors.bags.recorder.recordings import messages_of
from tests.actors.meeting import KEEP_ALL, Meeting, latched, until

if TYPE_CHECKING:
    from pathlib import Path

SEC = 10**9


async def received_by(recording: Recorder, count: int) -> None:
    """Wait until so many messages have arrived at a recorder."""
    await until(lambda: recording.statistics().received == count)


async def test_messages_are_published_with_their_times(meeting: Meeting, tmp_path: Path) -> None:
    """Each topic's in order, with the times when they were published first."""
    write_bag(tmp_path / "trip", 200)
    heard, counted = await listener(meeting, "/chatter"), await listener(meeting, "/count", Int32)
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        await until(lambda: len(heard) == len(counted) == 100)
        found = playing.statistics()
    assert [each.value.data for each in heard] == [f"text {index}" for index in range(0, 200, 2)]
    assert [each.stamp_ns - START_NS for each in heard] == [index - 5 for index in range(0, 200, 2)]
    assert [each.stamp_ns - START_NS for each in counted] == [index + 1 for index in range(0, 200, 2)]
    assert (found.published, found.dropped, found.invalid, found.passes) == (200, 0, 0, 1)
    assert found.topics == {"/chatter": 100, "/count": 100}
    assert not found.is_playing
    assert (found.position_ns, found.problems) == (START_NS + 199, ())


async def test_recording_playing_and_recording_again_changes_nothing(
    meeting: Meeting, tmp_path: Path
) -> None:
    """The same topics, and the same messages in the same order, with the same stamps and numbers."""
    first, second = tmp_path / "first", tmp_path / "second"
    node = await meeting.node("talker")
    chosen = Selection(topics=["/a", "/b"])
    async with Recorder(first, chosen, url=meeting.url) as recording:
        talkers = [node.create_publisher(String, name, 1000) for name in ("/a", "/b")]
        for talker in talkers:
            await talker.wait_for_subscriptions()
        for index in range(200):
            talkers[index % 3 // 2].publish(String(data=str(index)))
        await until(lambda: recording.statistics().written == 200)
    for talker in talkers:
        talker.destroy()
    async with (
        Recorder(second, chosen, url=meeting.url) as recording,
        player(meeting, first, rate=1000) as playing,
    ):
        await playing.wait()
        await until(lambda: recording.statistics().written == 200)

    def of_topic(bag: Path, topic: str) -> list[tuple[bytes, int, int]]:
        found = [each for each in messages_of(bag) if each.topic == topic]
        return [(each.data, each.publish_time, each.sequence) for each in found]

    assert [len(of_topic(first, topic)) for topic in ("/a", "/b")] == [134, 66]
    for topic in ("/a", "/b"):
        assert of_topic(second, topic) == of_topic(first, topic)
    with Reader(first) as before, Reader(second) as after:
        assert set(after.topics) == set(before.topics)


async def test_the_order_across_topics_is_kept(meeting: Meeting, tmp_path: Path) -> None:
    """Recorded, played step by step and recorded again: equal but for the time of reception."""
    node = await meeting.node("talker")
    talkers = [node.create_publisher(String, name, 1000) for name in ("/a", "/b", "/c")]
    chosen = Selection(topics=["/a", "/b", "/c"])
    async with Recorder(tmp_path / "first", chosen, url=meeting.url) as recording:
        for talker in talkers:
            await talker.wait_for_subscriptions()
        for index in range(30):
            talkers[index * 7 % 10 % 3].publish(String(data=str(index)))
            await received_by(recording, index + 1)
    for talker in talkers:
        talker.destroy()
    async with (
        Recorder(tmp_path / "second", chosen, url=meeting.url) as recording,
        player(meeting, tmp_path / "first", start_paused=True) as playing,
    ):
        for index in range(30):
            assert await playing.play_next()
            await received_by(recording, index + 1)
    first, second = (
        [each._replace(log_time=0) for each in messages_of(tmp_path / name)] for name in ("first", "second")
    )
    assert second == first
    assert [each.decoded(String).data for each in first] == [str(index) for index in range(30)]


async def test_a_choice_of_topics_under_other_names(meeting: Meeting, tmp_path: Path) -> None:
    """Filters compare recorded names, which remappings change."""
    write_bag(tmp_path / "trip")
    heard = await listener(meeting, "/other")
    chosen = Selection(topics=["/chatter"])
    async with player(meeting, tmp_path / "trip", chosen, remappings={"/chatter": "/other"}) as playing:
        await playing.wait()
        await until(lambda: len(heard) == 10)
        assert playing.statistics().topics == {"/chatter": 10}


async def test_the_recorded_qos_is_offered(meeting: Meeting, tmp_path: Path) -> None:
    """Latched messages reach late subscriptions; an override counts instead of what was recorded."""
    numbers(tmp_path / "trip", 5, latched(2))
    async with player(meeting, tmp_path / "trip", wait_for_all_acked_sec=0) as playing:
        await playing.wait()
        heard = await listener(meeting, "/count", Int32, latched(10))
        await until(lambda: len(heard) == 2)
    assert [each.value.data for each in heard] == [3, 4]
    override = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
    async with player(meeting, tmp_path / "trip", qos_overrides={"/count": override}) as playing:
        graph = await playing.node.get_graph()
        found = graph.endpoints(EntryKind.PUBLISHER, "/count")
        # The node of the first player may still be there.
        assert 3 in [each.qos_profile.depth for each in found]


async def test_nothing_is_dropped_for_speed(meeting: Meeting, tmp_path: Path) -> None:
    """What is due at once waits for room in the queue of its publisher, however short that is."""
    numbers(tmp_path / "trip", 500, QoSProfile(depth=1))
    heard = await listener(meeting, "/count", Int32)
    async with player(meeting, tmp_path / "trip", read_ahead=10) as playing:
        await playing.wait()
        assert playing.statistics().dropped == 0
        await until(lambda: len(heard) == 500)


async def test_a_part_is_played(meeting: Meeting, tmp_path: Path) -> None:
    """From an offset on, for a duration; both ends are played."""
    numbers(tmp_path / "trip", 100, QoSProfile(depth=100), step_ns=SEC)
    heard = await listener(meeting, "/count", Int32)
    options: dict[str, Any] = {"rate": 1e6, "start_offset_sec": 10, "duration_sec": 5}
    async with player(meeting, tmp_path / "trip", **options) as playing:
        await playing.wait()
        await until(lambda: len(heard) == 6)
    assert [each.value.data for each in heard] == list(range(10, 16))


async def test_passes(meeting: Meeting, tmp_path: Path) -> None:
    """With `loop` it begins again at each end, until it is stopped."""
    numbers(tmp_path / "trip", 3, QoSProfile(depth=100))
    heard = await listener(meeting, "/count", Int32)
    async with player(meeting, tmp_path / "trip", loop=True) as playing:
        await until(lambda: len(heard) >= 9)
        playing.stop()
        await playing.wait()
        assert playing.statistics().passes >= 2
    assert [each.value.data for each in heard[:9]] == [0, 1, 2] * 3


async def test_the_order_of_publishing(meeting: Meeting, tmp_path: Path) -> None:
    """Messages can be played by the time when they were published, also from an offset on.

    One was published after the last one was received, by a machine whose clock is ahead.
    """
    with Writer(tmp_path / "trip") as bag:
        topic = bag.add_topic(COUNT)
        for index, published in enumerate([5, 1, 2, 0]):
            bag.write(topic, number(published), START_NS + index * SEC, START_NS + published * SEC)
    heard = await listener(meeting, "/count", Int32)
    for offset, count in ((0, 4), (2, 6)):
        options: dict[str, Any] = {"order": Order.PUBLISH, "rate": 1e6, "start_offset_sec": offset}
        async with player(meeting, tmp_path / "trip", **options) as playing:
            await playing.wait()
            await received(heard, count)
    assert [each.value.data for each in heard] == [0, 1, 2, 5, 2, 5]


async def test_the_clock_shows_the_time_of_the_bag(meeting: Meeting, tmp_path: Path) -> None:
    """Also while paused; a recorded clock is not played then."""
    with Writer(tmp_path / "trip") as bag:
        recorded = bag.add_topic(BagTopic.of_class("/clock", Clock))
        bag.write(recorded, cdr.encode(Clock(clock=Time(sec=5))), START_NS, START_NS)
        bag.write(bag.add_topic(COUNT), number(1), START_NS + 7 * SEC, START_NS)
    heard = await listener(meeting, "/clock", Clock, QoSProfile(depth=100))
    async with player(meeting, tmp_path / "trip", clock_hz=200, start_paused=True) as playing:
        await until(lambda: len(heard) >= 3)
        assert {each.value.clock.sec for each in heard} == {START_NS // SEC}
        assert await playing.burst() == 1
        await until(lambda: heard[-1].value.clock.sec == START_NS // SEC + 7)
        assert playing.statistics().topics == {"/count": 1}


async def test_the_clock_of_topics(meeting: Meeting, tmp_path: Path) -> None:
    """The time of a message can be published before it."""
    numbers(tmp_path / "trip", 3, QoSProfile(depth=100), step_ns=SEC)
    heard = await listener(meeting, "/clock", Clock, KEEP_ALL)
    async with player(meeting, tmp_path / "trip", clock_topics=None, start_paused=True) as playing:
        for index in range(3):
            assert await playing.play_next()
            await received(heard, index + 1)
    assert [each.value.clock.sec - START_NS // SEC for each in heard] == [0, 1, 2]


async def test_other_nodes_control_it(meeting: Meeting, tmp_path: Path) -> None:
    """By services with the names and types of ROS 2's player."""
    numbers(tmp_path / "trip", 100, QoSProfile(depth=100), step_ns=3600 * SEC)
    heard = await listener(meeting, "/count", Int32)
    node = await meeting.node("operator")

    async def call(srv_type: Any, name: str, **fields: Any) -> Any:
        client = node.create_client(srv_type, f"/bag_player/{name}")
        return await client.call(srv_type.Request(**fields))

    async with player(meeting, tmp_path / "trip") as playing:
        await until(lambda: len(heard) == 1)
        assert not (await call(IsPaused, "is_paused")).paused
        assert not (await call(PlayNext, "play_next")).success
        assert (await call(Burst, "burst", num_messages=2)).actually_burst == 0
        await call(Pause, "pause")
        assert playing.is_paused
        await call(TogglePaused, "toggle_paused")
        assert not playing.is_paused
        await call(TogglePaused, "toggle_paused")
        assert (await call(IsPaused, "is_paused")).paused
        assert (await call(PlayNext, "play_next")).success
        assert (await call(Burst, "burst", num_messages=3)).actually_burst == 3
        middle = START_NS // SEC + 50 * 3600
        assert (await call(Seek, "seek", time=Time(sec=middle))).success
        assert not (await call(Seek, "seek", time=Time(sec=1))).success
        assert (await call(PlayNext, "play_next")).success
        await until(lambda: len(heard) == 6)
        assert [each.value.data for each in heard] == [0, 1, 2, 3, 4, 50]
        assert (await call(Burst, "burst")).actually_burst == 49
        assert not (await call(PlayNext, "play_next")).success
        assert (await call(Seek, "seek", time=Time(sec=middle))).success
        assert not (await call(SetRate, "set_rate", rate=0.0)).success
        assert (await call(SetRate, "set_rate", rate=1e9)).success
        assert (await call(GetRate, "get_rate")).rate == 1e9
        assert not (await call(Play, "play")).success
        await call(Resume, "resume")
        await playing.wait()
        await until(lambda: len(heard) == 6 + 49 + 50)
        request: dict[str, Any] = {
            "start_offset": Time(sec=99 * 3600),
            "playback_duration": Duration(sec=-1),
            "playback_until_timestamp": Time(sec=-1),
        }
        assert (await call(Play, "play", **request)).success
        await playing.wait()
        await until(lambda: len(heard) == 106)
        assert heard[-1].value.data == 99
        # As in ROS 2, an empty request plays no time at all: a duration of 0, up to 1970.
        assert (await call(Play, "play")).success
        await playing.wait()
        assert playing.statistics().published == 106
        await call(Pause, "pause")
        assert (await call(Play, "play", **request)).success
        await call(Stop, "stop")
        await playing.wait()
        assert not playing.statistics().is_playing


async def test_what_cannot_be_played_is_named(
    meeting: Meeting, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A topic of an unknown type once, and messages that are none of their type; the rest is played."""
    with Writer(tmp_path / "trip") as bag:
        strange = bag.add_topic(BagTopic("/strange", "a_msgs/msg/Strange", "b_msgs/Missing value"))
        chatter = bag.add_topic(BagTopic.of_class("/chatter", String))
        for index in range(3):
            bag.write(strange, text("x"), START_NS + index, START_NS)
            bag.write(chatter, text("y"), START_NS + index, START_NS)
        bag.write(chatter, b"\0\1\0\0\xff", START_NS + 9, START_NS)
    heard = await listener(meeting, "/chatter")
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        await until(lambda: len(heard) == 3)
        found = playing.statistics()
    assert (found.published, found.invalid) == (3, 1)
    assert [each for each in found.problems if "'/strange' is not played" in each]
    assert sum("'/strange' is not played" in each.getMessage() for each in caplog.records) == 1


async def test_topics_that_are_not_in_the_bag(meeting: Meeting, tmp_path: Path) -> None:
    """Names that were misspelt are reported, and the rest is played."""
    write_bag(tmp_path / "trip")
    chosen = Selection(topics=["/chatter", "/chater"], services=["/add"])
    async with player(meeting, tmp_path / "trip", chosen) as playing:
        await playing.wait()
        found = playing.statistics()
    assert found.topics == {"/chatter": 10}
    assert [each.partition(" is not")[0] for each in found.problems] == ["'/chater'", "'/add/_service_event'"]


async def test_topics_beyond_the_limit_are_counted(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 95: each type takes time and memory, however small the bag is."""
    monkeypatch.setattr(bag_source, "MAX_TOPICS", 1)
    write_bag(tmp_path / "trip")
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        found = playing.statistics()
    assert len(found.topics) == 1
    assert found.problems == ("1 more topics are not played; the limit is 1",)


async def test_damage_ends_the_playing(meeting: Meeting, tmp_path: Path) -> None:
    """What comes before it is played; then `wait` raises what is wrong, and where."""
    file = write_bag(tmp_path / "trip", 200)
    content = bytearray(file.read_bytes())
    place = content.index(b"text 180")
    content[place] ^= 1
    file.write_bytes(content)
    heard = await listener(meeting, "/chatter")
    async with player(meeting, tmp_path / "trip") as playing:
        with pytest.raises(BagError, match=r"trip_0\.mcap"):
            await playing.wait()
        await until(lambda: len(heard) >= 80)


async def test_damage_ends_a_burst(meeting: Meeting, tmp_path: Path) -> None:
    """Whoever waits for its end learns how many messages there were."""
    file = write_bag(tmp_path / "trip", 200)
    content = bytearray(file.read_bytes())
    content[content.index(b"text 180")] ^= 1
    file.write_bytes(content)
    async with player(meeting, tmp_path / "trip", start_paused=True) as playing:
        count = await playing.burst()
        with pytest.raises(BagError):
            await playing.wait()
        found = playing.statistics()
        assert (found.published, found.is_playing) == (count, False)
        assert 160 <= count < 200
        assert await playing.burst() == 0


async def test_a_bug_while_reading_ends_the_playing(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`wait` raises whatever error the reading thread has, rather than wait for messages for ever."""

    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(BagSource, "messages", broken)
    write_bag(tmp_path / "trip")
    async with player(meeting, tmp_path / "trip") as playing:
        with pytest.raises(ZeroDivisionError):
            await playing.wait()


async def test_further_files_are_told(meeting: Meeting, tmp_path: Path) -> None:
    """An event names the file that ends and the one that begins, before the first message of that."""
    with Writer(tmp_path / "trip", max_bag_duration_sec=2) as bag:
        topic = bag.add_topic(COUNT)
        for index in range(5):
            bag.write(topic, number(index), START_NS + index * SEC, START_NS)
    splits = await listener(meeting, "/events/read_split", ReadSplitEvent)
    async with player(meeting, tmp_path / "trip", rate=1e6, start_offset_sec=1) as playing:
        await playing.wait()
        await until(lambda: len(splits) >= 2)
    files = sorted(map(str, (tmp_path / "trip").glob("*.mcap")))
    assert len(files) == 3
    events = [each.value for each in splits]
    assert [(each.closed_file, each.opened_file) for each in events] == list(pairwise(files))
    assert {each.node_name for each in events} == {"/bag_player"}


async def test_a_definition_that_is_missing(meeting: Meeting, tmp_path: Path) -> None:
    """An empty one is that of an empty message: messages with contents are counted, and not played."""
    with Writer(tmp_path / "trip") as bag:
        empty = bag.add_topic(BagTopic("/empty", "a_msgs/msg/Nothing", ""))
        unknown = bag.add_topic(BagTopic("/unknown", "a_msgs/msg/Unknown", ""))
        bag.write(empty, cdr.encode(Empty()), START_NS, START_NS)
        bag.write(unknown, text("something"), START_NS, START_NS)
    async with player(meeting, tmp_path / "trip") as playing:
        await playing.wait()
        found = playing.statistics()
    assert (found.topics, found.invalid) == ({"/empty": 1, "/unknown": 0}, 1)


async def test_bags_that_are_none(meeting: Meeting, tmp_path: Path) -> None:
    """There is no bag, or it has no messages."""
    with pytest.raises(BagNotFoundError):
        await player(meeting, tmp_path / "nothing").__aenter__()
    with Writer(tmp_path / "empty") as bag:
        bag.add_topic(COUNT)
    with pytest.raises(BagError, match="no messages"):
        await player(meeting, tmp_path / "empty").__aenter__()


@pytest.mark.parametrize(
    "options",
    [
        {"rate": 0},
        {"start_offset_sec": -1},
        {"delay_sec": -1},
        {"delay_sec": float("nan")},
        {"clock_hz": 1e6},
        {"read_ahead": 0},
        {"order": Order.FILE},
    ],
)
def test_options_that_are_out_of_range(options: dict[str, Any]) -> None:
    """They are refused at once."""
    with pytest.raises(InvalidBagOptionError):
        PlayerOptions(**options)
