"""Written bags: splits, latched values, losses, a full disk. The library `mcap` reads them back."""

from __future__ import annotations

import json
import shutil
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from actors.bags import BagExistsError, BagFullError, BagTopic, BagWriteError, Writer
from actors.bags.contents.metadata import parse_metadata
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile
from tests.actors.bags.bags import CHATTER, START_NS, number, text

if TYPE_CHECKING:
    from pathlib import Path

    from mcap.records import Message

    from actors.bags.contents.records import BagMetadata


def latched(depth: int) -> QoSProfile:
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)


MAP = BagTopic.of_class("/map", Int32, [latched(1)])


def messages_of(path: Path) -> list[tuple[str, Message]]:
    with path.open("rb") as file:
        return [(channel.topic, message) for _, channel, message in make_reader(file).iter_messages()]


def metadata_of(folder: Path) -> BagMetadata:
    path = folder / "metadata.yaml"
    return parse_metadata(path.read_bytes(), str(path))


def test_messages_keep_their_bytes_times_and_numbers(tmp_path: Path) -> None:
    """A message is read back with its data, times and sequence number."""
    with Writer(tmp_path / "bag") as bag:
        chatter = bag.add_topic(CHATTER)
        assert bag.add_topic(CHATTER) == chatter
        bag.write(chatter, text("a"), START_NS + 1, START_NS, 7)
    [(topic, message)] = messages_of(tmp_path / "bag" / "bag_0.mcap")
    assert topic == "/chatter"
    assert message.data == text("a")
    assert (message.log_time, message.publish_time, message.sequence) == (START_NS + 1, START_NS, 7)


def test_log_time_never_goes_back(tmp_path: Path) -> None:
    """A message with an earlier log time than the preceding one gets its time, and is counted."""
    with Writer(tmp_path / "bag") as bag:
        chatter = bag.add_topic(CHATTER)
        for log_time in (5, 3, 6):
            bag.write(chatter, text("a"), START_NS + log_time, START_NS)
        assert bag.reordered == 1
    times = [message.log_time - START_NS for _, message in messages_of(tmp_path / "bag" / "bag_0.mcap")]
    assert times == [5, 5, 6]


def test_flushed_messages_can_be_read_before_the_bag_is_closed(tmp_path: Path) -> None:
    """Flushed messages can be read, with their schemas and channels, although there is no summary."""
    bag = Writer(tmp_path / "bag")
    chatter = bag.add_topic(CHATTER)
    bag.write(chatter, text("a"), START_NS, START_NS)
    bag.flush()
    bag.write(chatter, text("b"), START_NS, START_NS)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        records = StreamReader(file).records
        names = [type(next(records)).__name__ for _ in range(4)]
    assert names == ["Header", "Schema", "Channel", "Message"]
    bag.close()


def test_same_topic_of_two_types_is_two_channels(tmp_path: Path) -> None:
    """A topic with a second type has a second channel and schema."""
    with Writer(tmp_path / "bag") as bag:
        first, second = bag.add_topic(CHATTER), bag.add_topic(BagTopic.of_class("/chatter", Int32))
        bag.write(first, text("a"), START_NS, START_NS)
        bag.write(second, number(1), START_NS, START_NS)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        found = [
            (schema and schema.name, message.data) for schema, _, message in make_reader(file).iter_messages()
        ]
    assert found == [("std_msgs/msg/String", text("a")), ("std_msgs/msg/Int32", number(1))]


def test_split_repeats_the_newest_latched_value_of_each_publisher(tmp_path: Path) -> None:
    """Each file starts with the latched messages, with their publish times; others are not repeated."""
    with Writer(tmp_path / "bag") as bag:
        chatter, chart = bag.add_topic(CHATTER), bag.add_topic(MAP)
        bag.write(chart, number(1), START_NS, START_NS, latched_key="a")
        bag.write(chart, number(2), START_NS + 1, START_NS + 1, latched_key="a")
        bag.write(chart, number(3), START_NS + 2, START_NS + 2, latched_key="b")
        bag.write(chatter, text("x"), START_NS + 3, START_NS + 3, latched_key="c")
        bag.split()
        bag.write(chatter, text("y"), START_NS + 9, START_NS + 9)
    found = messages_of(tmp_path / "bag" / "bag_1.mcap")
    assert [(topic, message.data, message.publish_time - START_NS) for topic, message in found] == [
        ("/map", number(2), 1),
        ("/map", number(3), 2),
        ("/chatter", text("y"), 9),
    ]
    assert found[0][1].log_time == START_NS + 3


@pytest.mark.parametrize(
    ("offers", "first"),
    [
        ([latched(1), latched(3)], 17),
        ([latched(1), QoSProfile(depth=10)], 19),
        ([QoSProfile(history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL)], 0),
    ],
)
def test_split_repeats_what_a_late_joiner_would_get(
    tmp_path: Path, offers: list[QoSProfile], first: int
) -> None:
    """As many messages of each publisher as the greatest latched depth, in order of arrival."""
    with Writer(tmp_path / "bag") as bag:
        events = bag.add_topic(BagTopic.of_class("/events", Int32, offers))
        for index in range(20):
            for key in ("a", "b"):
                bag.write(events, number(index), START_NS + index, START_NS, index, latched_key=key)
        bag.split()
        bag.split()
    for name in ("bag_1.mcap", "bag_2.mcap"):
        found = [message.sequence for _, message in messages_of(tmp_path / "bag" / name)]
        assert found == [index for index in range(first, 20) for _ in range(2)]


@pytest.mark.parametrize("limit", ["MAX_LATCHED", "MAX_LATCHED_BYTES"])
def test_a_flood_of_latched_messages_leaves_the_newest_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str
) -> None:
    """At the limit, a publisher's older messages go before the only one of another."""
    monkeypatch.setattr(f"actors.bags.writer.{limit}", 5 if limit == "MAX_LATCHED" else 5 * len(number(0)))
    with Writer(tmp_path / "bag") as bag:
        chart, events = bag.add_topic(MAP), bag.add_topic(BagTopic.of_class("/events", Int32, [latched(100)]))
        bag.write(chart, number(0), START_NS, START_NS, latched_key="map")
        for index in range(50):
            bag.write(events, number(index), START_NS + index, START_NS, index, latched_key="events")
        bag.split()
        for index in range(6):
            bag.write(chart, number(index), START_NS + 50, START_NS, index, latched_key=index)
        bag.split()
    found = [(topic, message.sequence) for topic, message in messages_of(tmp_path / "bag" / "bag_1.mcap")]
    assert found[:5] == [("/map", 0), *(("/events", index) for index in (46, 47, 48, 49))]
    found = [(topic, message.sequence) for topic, message in messages_of(tmp_path / "bag" / "bag_2.mcap")]
    assert found == [("/map", index) for index in range(1, 6)]


def test_repeated_messages_fill_half_of_a_file_at_most(tmp_path: Path) -> None:
    """Otherwise each message would start another file; the newest message of a publisher may be larger."""
    topic = BagTopic.of_class("/text", String, [latched(100)])
    with Writer(tmp_path / "bag", max_bag_size=8000, chunk_size=1) as bag:
        texts, chart = bag.add_topic(topic), bag.add_topic(BagTopic.of_class("/chart", String, [latched(1)]))
        bag.write(chart, text("x" * 3000), START_NS, START_NS, latched_key="chart")
        for index in range(30):
            bag.write(texts, text("x" * 500), START_NS + index, START_NS, index, latched_key="a")
    files = metadata_of(tmp_path / "bag").files
    assert 2 < len(files) < 10
    for file in files[1:]:
        found = messages_of(tmp_path / "bag" / file.path)
        assert [topic for topic, _ in found[:3]] == ["/chart", "/text", "/text"]
        assert len(found) > 4


def test_split_by_size_and_by_duration(tmp_path: Path) -> None:
    """A new file starts at the maximal size or duration; metadata.yaml lists all files and counts."""
    with Writer(tmp_path / "size", max_bag_size=5000) as bag:
        chatter = bag.add_topic(CHATTER)
        for index in range(12):
            bag.write(chatter, text("x" * 1000), START_NS + index, START_NS)
    assert [each.message_count for each in metadata_of(tmp_path / "size").files] == [5, 5, 2]
    with Writer(tmp_path / "time", max_bag_duration_sec=2) as bag:
        chatter = bag.add_topic(CHATTER)
        for index in range(5):
            bag.write(chatter, text("x"), START_NS + index * 10**9, START_NS)
    metadata = metadata_of(tmp_path / "time")
    assert [(each.path, each.message_count) for each in metadata.files] == [
        ("time_0.mcap", 2),
        ("time_1.mcap", 2),
        ("time_2.mcap", 1),
    ]
    assert metadata.message_count == metadata.topics[0].message_count == 5
    assert (metadata.start_ns, metadata.duration_ns) == (START_NS, 4 * 10**9)


def test_oldest_file_is_deleted_beyond_max_splits(tmp_path: Path) -> None:
    """The newest `max_splits` files remain, and metadata.yaml counts only their messages."""
    with Writer(tmp_path / "bag", max_splits=2) as bag:
        chatter = bag.add_topic(CHATTER)
        for index in range(4):
            bag.write(chatter, text("x"), START_NS + index, START_NS)
            if index < 3:
                bag.split()
    names = ["bag_2.mcap", "bag_3.mcap"]
    assert sorted(each.name for each in (tmp_path / "bag").glob("*.mcap")) == names
    metadata = metadata_of(tmp_path / "bag")
    assert [each.path for each in metadata.files] == names
    assert metadata.message_count == 2
    assert metadata.start_ns == START_NS + 2


def test_losses_and_custom_data_are_in_the_metadata(tmp_path: Path) -> None:
    """metadata.yaml has the custom data and the losses; the MCAP file has the losses as well."""
    with Writer(tmp_path / "bag", custom_data={"robot": "1e3", "note": ""}) as bag:
        bag.add_topic(CHATTER)
        bag.set_losses({"/chatter": 3, "/map": 0})
    custom_data = metadata_of(tmp_path / "bag").custom_data
    assert json.loads(custom_data["callboard.dropped"]) == {"/chatter": 3}
    assert (custom_data["robot"], custom_data["note"]) == ("1e3", "")
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        records = {each.name: each.metadata for each in make_reader(file).iter_metadata()}
    assert records["callboard.dropped"] == {"/chatter": "3"}
    assert "name: /chatter" in records["rosbag2"]["serialized_metadata"]


@pytest.mark.parametrize("compression", ["none", "zstd", "lz4"])
def test_chunks_can_be_compressed(tmp_path: Path, compression: str) -> None:
    """The library reads chunks of each compression, and verifies their checksums."""
    with Writer(tmp_path / "bag", compression=compression) as bag:
        chatter = bag.add_topic(CHATTER)
        for index in range(100):
            bag.write(chatter, text("x" * 100), START_NS + index, START_NS)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == 100
        summary = reader.get_summary()
    assert summary is not None
    assert [each.compression for each in summary.chunk_indexes] == [
        "" if compression == "none" else compression
    ]


def test_a_split_that_fails_ends_the_bag_once(tmp_path: Path) -> None:
    """The message that needed the file is counted, and closing does not finish the former file again."""
    bag = Writer(tmp_path / "bag", max_bag_size=1024)
    chatter = bag.add_topic(CHATTER)
    bag.write(chatter, text("x" * 2000), START_NS, START_NS)
    shutil.rmtree(tmp_path / "bag")
    with pytest.raises(BagWriteError):
        bag.write(chatter, text("y"), START_NS + 1, START_NS)
    assert bag.lost() == {"/chatter": 1}
    with pytest.raises(BagWriteError):
        bag.close()
    assert bag.files == 1


def test_existing_path_is_refused(tmp_path: Path) -> None:
    """A writer never replaces an existing path."""
    with pytest.raises(BagExistsError, match="choose another path"):
        Writer(tmp_path)


def test_wrong_limits_are_refused(tmp_path: Path) -> None:
    """Too small a size, a negative limit and an unknown compression are ValueErrors."""
    with pytest.raises(ValueError, match="at least 1024"):
        Writer(tmp_path / "bag", max_bag_size=10)
    with pytest.raises(ValueError, match="negative"):
        Writer(tmp_path / "bag", max_splits=-1)
    with pytest.raises(ValueError, match="none, zstd, lz4"):
        Writer(tmp_path / "bag", compression="gzip")


@pytest.mark.parametrize("limit", range(40_000, 45_000, 600))
def test_full_disk_leaves_a_bag_with_what_fitted(tmp_path: Path, limit: int) -> None:
    """Case 42: a full disk raises BagFullError; the bag has a summary, and states the lost messages."""
    resource = pytest.importorskip("resource")
    signal = pytest.importorskip("signal")
    bag = Writer(tmp_path / "bag", chunk_size=4096)
    chatter = bag.add_topic(CHATTER)
    old_handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    written, refusal = 0, ""
    try:
        # The limit on the size of files is the disk that is full.
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limits[1]))
        try:
            for written in range(1, 1000):
                bag.write(chatter, text("x" * 500), START_NS + written, START_NS)
        except BagFullError as error:
            refusal = str(error)
        with suppress(BagFullError):  # if the summary takes the space of the last chunks
            bag.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, old_handler)
    assert "bag_0.mcap: the disk is full" in refusal
    kept = len(messages_of(tmp_path / "bag" / "bag_0.mcap"))
    assert 50 < kept < written
    metadata = metadata_of(tmp_path / "bag")
    assert metadata.message_count == kept
    assert json.loads(metadata.custom_data["callboard.dropped"]) == {"/chatter": written - kept}
