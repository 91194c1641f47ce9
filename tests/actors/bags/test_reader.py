"""Bags that are read: order, filters, several files, files whose end is missing, and what is refused."""

from __future__ import annotations

import shutil
import struct
import tracemalloc
from typing import TYPE_CHECKING

import pytest
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as ForeignWriter

from actors.bags import BagNotFoundError, BagTopic, InvalidBagError, Reader, Writer
from actors.bags.storage import compression as compression_module
from actors.bags.storage import mcap_reader, mcap_summary
from actors.interfaces.std_msgs.msg import String
from tests.actors.bags.bags import CHATTER, COUNT, START_NS, text, write_bag

if TYPE_CHECKING:
    from pathlib import Path


def times_of(reader: Reader, order: str = "log") -> list[int]:
    return [message.log_time_ns - START_NS for message in reader.messages(order=order)]


def foreign_file(path: Path, times: list[int], **options: object) -> Path:
    """Write a file of strings with these log times by the library; publish times go back."""
    with path.open("wb") as file:
        writer = ForeignWriter(file, **options)  # type: ignore[arg-type]
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", "cdr", schema)
        for index, time in enumerate(times):
            writer.add_message(channel, START_NS + time, text(str(index)), START_NS - index, index)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_messages_are_read_as_they_were_written(tmp_path: Path) -> None:
    """Data, times, numbers, topics with their QoS and definitions are the same."""
    write_bag(tmp_path / "bag")
    with Reader(tmp_path / "bag") as bag:
        messages = list(bag.messages())
        assert set(bag.topics) == {CHATTER, COUNT}
    assert len(messages) == 20
    first, second = messages[:2]
    assert (first.topic, first.data, first.sequence) == (CHATTER, text("text 0"), 0)
    assert (first.log_time_ns, first.publish_time_ns) == (START_NS, START_NS - 5)
    assert second.decoded() == second.topic.message_class()(data=0)
    assert isinstance(first.decoded(), String)


async def test_async_iteration_gives_all_messages(tmp_path: Path) -> None:
    """`async for` gives the same messages as `messages`."""
    write_bag(tmp_path / "bag", 250)
    reader = Reader(tmp_path / "bag")
    assert [message.log_time_ns - START_NS async for message in reader] == list(range(250))
    reader.close()


def test_filters(tmp_path: Path) -> None:
    """Topics and times choose messages; both ends are included."""
    write_bag(tmp_path / "bag")
    with Reader(tmp_path / "bag") as bag:
        assert {each.topic for each in bag.messages(["/count"])} == {COUNT}
        some = bag.messages(start_ns=START_NS + 3, end_ns=START_NS + 6)
        assert [each.log_time_ns - START_NS for each in some] == [3, 4, 5, 6]
        assert list(bag.messages(["/nothing"])) == []


def test_several_files_are_one(tmp_path: Path) -> None:
    """Messages come by time over all files, in the order of metadata.yaml or of their numbers."""
    with Writer(tmp_path / "bag", max_bag_duration_sec=3e-9) as writer:
        chatter = writer.add_topic(CHATTER)
        for index in range(40):
            writer.write(chatter, text("x"), START_NS + index, START_NS)
    assert len(list((tmp_path / "bag").glob("*.mcap"))) == 14
    with Reader(tmp_path / "bag") as bag:
        assert times_of(bag) == list(range(40))
        assert times_of(bag, "file") == list(range(40))
        assert bag.summary().message_count == bag.summary(quick=False).message_count == 40
    (tmp_path / "bag" / "metadata.yaml").unlink()
    with Reader(tmp_path / "bag") as bag:
        assert times_of(bag) == list(range(40))
        assert "callboard bag reindex" in bag.summary().problems[0]


def test_files_that_overlap_are_merged(tmp_path: Path) -> None:
    """Of files with the same span, messages come in turn."""
    foreign_file(tmp_path / "a_0.mcap", list(range(0, 40, 2)))
    foreign_file(tmp_path / "a_1.mcap", list(range(1, 40, 2)))
    with Reader(tmp_path) as bag:
        assert times_of(bag) == list(range(40))


@pytest.mark.parametrize("chunk_size", [1, 100, 100_000])
def test_unsorted_files_are_read_by_time(
    tmp_path: Path, chunk_size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In files whose times go back, within chunks and between them, messages come by log time."""
    monkeypatch.setattr(mcap_summary, "SORTED_AT_ONCE", 7)
    times = [(index * 7) % 50 for index in range(50)]
    path = foreign_file(tmp_path / "a.mcap", times, chunk_size=chunk_size)
    with Reader(path) as bag:
        assert times_of(bag) == list(range(50))
        assert times_of(bag, "file") == times
        sent = [message.publish_time_ns for message in bag.messages(order="publish")]
    assert sent == sorted(sent)


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"index_types": IndexType.NONE},
        {"use_statistics": False},
        {"use_summary_offsets": False},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"enable_crcs": False},
    ],
)  # fmt: skip
def test_foreign_files_of_each_form_are_read(tmp_path: Path, options: dict[str, object]) -> None:
    """Files with and without compression, chunks, indexes and repeated records have the same messages."""
    path = foreign_file(tmp_path / "a.mcap", [3, 1, 2], **options)
    with Reader(path) as bag:
        assert times_of(bag) == [1, 2, 3]
        summary = bag.summary()
        assert (summary.message_count, summary.start_ns - START_NS, summary.duration_ns) == (3, 1, 2)
        assert summary.problems == ()


@pytest.mark.parametrize("compression", ["none", "zstd", "lz4"])
def test_a_file_cut_anywhere_has_its_whole_chunks(tmp_path: Path, compression: str) -> None:
    """Case 94: cut at each place, a file gives the messages of its whole chunks, in order, and a problem."""
    path = write_bag(tmp_path / "bag", compression=compression)
    whole = path.read_bytes()
    with Reader(path) as bag:
        messages = list(bag.messages())
    counts = set[int]()
    for end in range(8, len(whole), 17):
        (tmp_path / "cut.mcap").write_bytes(whole[:end])
        with Reader(tmp_path / "cut.mcap") as bag:
            found = list(bag.messages())
            assert bag.summary().problems
        assert [message.data for message in found] == [message.data for message in messages[: len(found)]]
        counts.add(len(found))
    assert {0, 20} < counts
    assert sorted(counts) == sorted(counts | {len(messages)})


def test_changed_bytes_are_found_by_name_and_place(tmp_path: Path) -> None:
    """A changed byte of a chunk is an InvalidBagError with the file and the place of the chunk."""
    path = write_bag(tmp_path / "bag")
    data = bytearray(path.read_bytes())
    place = data.index(b"text 8")
    data[place] ^= 1
    path.write_bytes(data)
    with (
        Reader(path) as bag,
        pytest.raises(InvalidBagError, match=r"bag_0\.mcap: byte [\d,]+: the checksum of a chunk") as caught,
    ):
        list(bag.messages())
    assert caught.value.path == path


def test_every_changed_byte_is_an_error_or_harmless(tmp_path: Path) -> None:
    """Case 94: whatever byte is changed, reading raises only InvalidBagError, and takes no large memory."""
    path = write_bag(tmp_path / "bag", 6)
    whole = path.read_bytes()
    for place in range(0, len(whole), 7):
        data = bytearray(whole)
        data[place] = 0xFF
        path.write_bytes(data)
        try:
            with Reader(path, max_chunk_bytes=1 << 20) as bag:
                for message in bag.messages():
                    assert len(message.data) < 1000
        except InvalidBagError as error:
            assert str(path) in str(error)  # noqa: PT017


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_beyond_the_limit_is_refused(
    tmp_path: Path, compression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 93: a chunk that states, or has, more bytes than allowed is refused before they are made."""
    with Writer(tmp_path / "bag", compression=compression) as writer:
        chatter = writer.add_topic(CHATTER)
        writer.write(chatter, text("x" * 100_000), START_NS, START_NS)
    path = tmp_path / "bag" / "bag_0.mcap"
    with (
        Reader(path, max_chunk_bytes=50_000) as bag,
        pytest.raises(InvalidBagError, match="limit is 50,000"),
    ):
        list(bag.messages())
    # A few bytes may become SPARE_BYTES, and no more, however much a chunk may have.
    with monkeypatch.context() as patch, Reader(path) as bag:
        patch.setattr(compression_module, "SPARE_BYTES", 1000)
        patch.setattr(compression_module, "MAX_EXPANSION", 50)
        with pytest.raises(InvalidBagError, match=r"a chunk of .* announces 100,.*; the limit is"):
            list(bag.messages())
    # Less is stated than there is: what is made is never more than what is stated.
    data = bytearray(path.read_bytes())
    place = next(
        at
        for at in range(len(data))
        if data[at] == 6 and 100_000 < int.from_bytes(data[at + 25 : at + 33], "little") < 110_000
    )
    data[place + 25 : place + 33] = (50_000).to_bytes(8, "little")
    path.write_bytes(data)
    with Reader(path) as bag, pytest.raises(InvalidBagError, match="more than 50,000 bytes"):
        list(bag.messages())


def test_what_a_summary_has_besides_is_not_read(tmp_path: Path) -> None:
    """A record of an unknown kind may state any length that the file has: a sparse file has much."""
    path = foreign_file(tmp_path / "bag.mcap", [1, 2])
    whole, size = path.read_bytes(), 64 * 1024 * 1024
    end = len(whole) - 37  # the footer and the magic
    with path.open("wb") as file:
        file.write(whole[:end] + struct.pack("<BQ", 0x80, size))
        file.seek(size, 1)
        file.write(whole[end:])
    tracemalloc.start()
    try:
        with Reader(path) as bag:
            assert bag.summary().message_count == 2
        assert tracemalloc.get_traced_memory()[1] < size // 4
    finally:
        tracemalloc.stop()


def test_chunks_that_overlap_without_end_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is held of all of them at once has a limit; a chunk that has been read no longer counts."""
    monkeypatch.setattr(mcap_reader, "MAX_OPEN_MESSAGES", 4)
    overlapping = foreign_file(tmp_path / "overlapping.mcap", [0, 9] * 3, chunk_size=1)
    sorted_file = foreign_file(tmp_path / "sorted.mcap", list(range(20)), chunk_size=1)
    with Reader(sorted_file) as bag:
        assert times_of(bag) == list(range(20))
    with Reader(overlapping) as bag:
        assert len(times_of(bag)) == 6
    whole = foreign_file(tmp_path / "whole.mcap", [0, 9] * 3)
    with Reader(whole) as bag, pytest.raises(InvalidBagError, match="whose times overlap"):
        times_of(bag)


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    """A missing path, an empty folder, an empty file, a foreign file and a missing file each say so."""
    with pytest.raises(BagNotFoundError):
        list(Reader(tmp_path / "none").messages())
    (tmp_path / "folder").mkdir()
    with pytest.raises(BagNotFoundError, match="is not a bag"):
        Reader(tmp_path / "folder")
    for content, reason in (
        (b"", "it is empty"),
        (b"something else, and long enough", "neither an MCAP nor"),
    ):
        (tmp_path / "file.mcap").write_bytes(content)
        with pytest.raises(InvalidBagError, match=reason):
            list(Reader(tmp_path / "file.mcap").messages())
    write_bag(tmp_path / "bag").unlink()
    with Reader(tmp_path / "bag") as bag:
        assert bag.summary().problems
        with pytest.raises(BagNotFoundError, match=r"bag_0\.mcap"):
            list(bag.messages())


def test_a_pipe_in_the_folder_does_not_hang(tmp_path: Path) -> None:
    """A named pipe in place of a file is refused at once."""
    import os  # noqa: PLC0415 - of systems that have pipes

    path = write_bag(tmp_path / "bag")
    path.unlink()
    os.mkfifo(path)
    with Reader(tmp_path / "bag") as bag, pytest.raises(InvalidBagError, match="not a regular file"):
        list(bag.messages())


def test_moved_folders_are_read(tmp_path: Path) -> None:
    """A renamed folder is the same bag: its files have their names from metadata.yaml."""
    write_bag(tmp_path / "bag")
    shutil.move(tmp_path / "bag", tmp_path / "other")
    with Reader(tmp_path / "other") as bag:
        assert times_of(bag) == list(range(20))


def test_topic_of_two_types(tmp_path: Path) -> None:
    """Both types of a topic are read with their own definitions."""
    other = BagTopic.of_class("/chatter", String)
    with Writer(tmp_path / "bag") as writer:
        first, second = (
            writer.add_topic(CHATTER),
            writer.add_topic(BagTopic("/chatter", "lab_msgs/msg/A", "int8 x\n")),
        )
        assert writer.add_topic(other) == first
        writer.write(first, text("a"), START_NS, START_NS)
        writer.write(second, b"\0\1\0\0\7", START_NS, START_NS)
    with Reader(tmp_path / "bag") as bag:
        found = [message.decoded() for message in bag.messages()]
    assert [type(each).__struct_fields__ for each in found] == [("data",), ("x",)]
