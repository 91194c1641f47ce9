"""Bags of callboard read by other libraries, and theirs read by callboard, field by field."""

from __future__ import annotations

import math
import random
import sqlite3
from typing import TYPE_CHECKING, Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as McapRos2Writer
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Reader as RosbagsReader
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from actors.bags import BagTopic, InvalidBagError, Player, Reader, Writer
from actors.bags.contents.qos_lists import qos_text
from actors.bags.operations.convert import convert
from actors.interfaces import cdr
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.fields import fields_of
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from actors.interfaces.std_msgs.msg import Header, String
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile
from tests.actors.bags.bags import START_NS, text
from tests.actors.meeting import until
from tests.interfaces.random_messages import random_message, values_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from rosbags.typesys.store import Typestore

    from actors import MessageInfo
    from actors.interfaces.message import Message
    from tests.actors.meeting import Meeting

PROFILE = QoSProfile(depth=7, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FOREVER = QosTime(9223372036, 854775807)
FOREIGN_PROFILE = Qos(
    QosHistory.KEEP_LAST, 7, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, FOREVER, FOREVER,
    QosLiveliness.AUTOMATIC, FOREVER, avoid_ros_namespace_conventions=False,
)  # fmt: skip


def has_wstring(cls: Any) -> bool:
    """Return whether a class has a wstring, for which decoders have different ideas of its encoding."""
    kinds = [field.type for field in fields_of(cls)]
    return any(kind.base == "wstring" or (kind.message and has_wstring(kind.message)) for kind in kinds)


def message_types() -> list[type[Message]]:
    names = [name for package in standard_packages() for name in interfaces_of(package) if "/msg/" in name]
    found: list[type[Message]] = [find_interface(name) for name in names]  # type: ignore[misc]
    return [cls for cls in found if not has_wstring(cls)]


def same(ours: Any, theirs: Any) -> bool:
    """Compare plain values with those of another library's message."""
    if hasattr(theirs, "tolist"):  # NumPy's
        theirs = theirs.tolist()
    if isinstance(ours, dict):
        return all(same(value, getattr(theirs, name)) for name, value in ours.items())
    if isinstance(ours, list):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(theirs, bytes):
        theirs = theirs[0]
    if isinstance(theirs, int) and theirs < 0 <= ours:
        theirs += 256  # rosbags has signed bytes, and mcap-ros2-support signed chars; rosidl has neither
    if isinstance(ours, float):
        return bool(ours == theirs) and math.copysign(1, ours) == math.copysign(1, theirs)
    return bool(ours == theirs)


def rewritten_by_mcap_ros2(source: Path, messages: Sequence[Message], target: Path) -> Path:
    """Let mcap-ros2-support decode the messages of a file, compare, and let it encode them into another."""
    with source.open("rb") as opened, target.open("wb") as file:
        writer = McapRos2Writer(file)
        decoded = make_reader(opened, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        for ours, (schema, channel, message, theirs) in zip(messages, decoded, strict=True):
            assert same(values_of(ours), theirs), schema
            assert schema is not None
            own = writer.register_msgdef(schema.name, schema.data.decode())
            writer.write_message(channel.topic, own, theirs, message.log_time, message.publish_time)
        writer.finish()  # type: ignore[no-untyped-call]
    return target


def rewritten_by_rosbags(source: Path, messages: Sequence[Message], target: Path) -> Path:
    """Let rosbags do so with folders."""
    store = get_typestore(Stores.EMPTY)
    with RosbagsReader(source.parent) as reader, RosbagsWriter(target, version=9) as writer:
        assert len(reader.connections) == len(messages)
        for index, (connection, timestamp, data) in enumerate(reader.messages()):
            name = connection.msgtype
            assert timestamp == START_NS + index
            assert connection.ext.offered_qos_profiles == [FOREIGN_PROFILE]  # type: ignore[union-attr]
            add_types(store, connection.msgdef.data, name)
            theirs = store.deserialize_cdr(data, name)
            assert same(values_of(messages[index]), theirs), name
            own = writer.add_connection(connection.topic, name, typestore=store)
            writer.write(own, timestamp, store.serialize_cdr(theirs, name))
    return target


async def test_all_standard_types_are_exchanged_with_other_libraries(
    meeting: Meeting, tmp_path: Path
) -> None:
    """rosbags and mcap-ros2-support read each type; what they write of it is played, field by field."""
    chance = random.Random(37)
    messages = [random_message(cls, chance) for cls in message_types()]
    assert len(messages) > 190
    with Writer(tmp_path / "bag", compression="zstd") as bag:
        for index, message in enumerate(messages):
            topic = BagTopic.of_class(f"/topic{index}", type(message), [PROFILE])
            bag.write(bag.add_topic(topic), cdr.encode(message), START_NS + index, START_NS + 2 * index)
    heard: dict[int, tuple[bytes, int]] = {}
    node = await meeting.node("listener")
    for index, message in enumerate(messages):

        def keep(found: Message, info: MessageInfo, index: int = index) -> None:
            heard[index] = cdr.encode(found), info.source_timestamp

        node.create_subscription(type(message), f"/topic{index}", keep, 1)
    await meeting.settled(node)
    # Bags of rosbags have no times of publishing.
    for rewrite, step in ((rewritten_by_mcap_ros2, 2), (rewritten_by_rosbags, 1)):
        heard.clear()
        path = rewrite(tmp_path / "bag" / "bag_0.mcap", messages, tmp_path / rewrite.__name__)
        async with Player(path, url=meeting.url) as playing:
            await playing.wait()
            await until(lambda: len(heard) == len(messages))
            assert (playing.statistics().invalid, playing.statistics().problems) == (0, ())
        for index, message in enumerate(messages):
            assert heard[index] == (cdr.encode(message), START_NS + step * index), message


def test_other_libraries_read_topics_beside_services_and_actions(tmp_path: Path) -> None:
    """The types of their events have names that these libraries do not know; other topics are readable."""
    action: Any = Fibonacci.Impl
    event: Any = AddTwoInts.Event
    classes: list[Any] = [String, event, action.FeedbackMessage, action.GetResultService.Event]
    with Writer(tmp_path / "bag") as bag:
        for index, cls in enumerate(classes):
            number = bag.add_topic(BagTopic.of_class(f"/topic{index}", cls))
            bag.write(number, cdr.encode(cls()), START_NS + index, START_NS)
    with AnyReader([tmp_path / "bag"]) as reader:
        assert [each.topic for each, _, _ in reader.messages()] == [f"/topic{index}" for index in range(4)]
        texts = [each for each in reader.connections if each.topic == "/topic0"]
        found: Any
        (found,) = [reader.deserialize(data, each.msgtype) for each, _, data in reader.messages(texts)]
        assert found.data == ""
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(["/topic0"])
        assert [message.data for *_, message in decoded] == [""]
    with Reader(tmp_path / "bag") as bag:
        assert [type_name(type(each.decoded())) for each in bag.messages()] == list(map(type_name, classes))


def add_types(store: Typestore, definition: str, name: str) -> None:
    types = get_types_from_msg(definition, name)
    store.register({each: kind for each, kind in types.items() if each not in store.fielddefs})


def write_foreign(path: Path, storage: StoragePlugin, mode: CompressionMode, version: Any) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = RosbagsWriter(path, version=version, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer as bag:
        chatter = bag.add_connection(
            "/chatter", "std_msgs/msg/String", typestore=store, offered_qos_profiles=[FOREIGN_PROFILE]
        )
        header = bag.add_connection("/header", "std_msgs/msg/Header", typestore=store)
        kinds = store.types
        time = kinds["builtin_interfaces/msg/Time"](sec=5, nanosec=6)
        for index in range(3):
            message: Any = kinds["std_msgs/msg/String"](data=f"text {index}")
            bag.write(chatter, START_NS + 2 * index, store.serialize_cdr(message, "std_msgs/msg/String"))
            message = kinds["std_msgs/msg/Header"](stamp=time, frame_id="map")
            bag.write(header, START_NS + 2 * index + 1, store.serialize_cdr(message, "std_msgs/msg/Header"))


@pytest.mark.parametrize("version", [8, 9])
@pytest.mark.parametrize(
    ("storage", "mode"),
    [
        (StoragePlugin.SQLITE3, CompressionMode.NONE),
        (StoragePlugin.SQLITE3, CompressionMode.FILE),
        (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
        (StoragePlugin.MCAP, CompressionMode.NONE),
        (StoragePlugin.MCAP, CompressionMode.FILE),
        (StoragePlugin.MCAP, CompressionMode.MESSAGE),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
    ],
)
def test_bags_of_rosbags_are_read(
    tmp_path: Path, storage: StoragePlugin, mode: CompressionMode, version: int
) -> None:
    """Bags of each storage and compression mode have the same messages here, with classes of this program."""
    write_foreign(tmp_path / "bag", storage, mode, version)
    with Reader(tmp_path / "bag") as bag:
        summary = bag.summary()
        assert (summary.message_count, summary.start_ns, summary.duration_ns) == (6, START_NS, 5)
        assert {each.topic.name: each.message_count for each in summary.topics} == {
            "/chatter": 3,
            "/header": 3,
        }
        messages = [message.decoded() for message in bag.messages()]
        [chatter] = [topic for topic in bag.topics if topic.name == "/chatter"]
    assert chatter.qos_profiles == (PROFILE,)
    assert messages[::2] == [String(data=f"text {index}") for index in range(3)]
    assert all(isinstance(each, Header) and each.stamp.nanosec == 6 for each in messages[1::2])


def test_files_of_mcap_ros2_support_are_read(tmp_path: Path) -> None:
    """A bare file, whose names of types have two parts, and definitions one line at the end too few."""
    definition = (
        f"std_msgs/Header header\nfloat64[3] x\n{'=' * 80}\nMSG: std_msgs/Header\nuint32 seq\nstring frame"
    )
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = McapRos2Writer(file)
        schema = writer.register_msgdef("lab_msgs/Reading", definition)
        writer.write_message(
            "/reading",
            schema,
            {"header": {"seq": 3, "frame": "map"}, "x": [1.0, 2.0, 3.0]},
            START_NS,
            START_NS - 1,
            5,
        )
        writer.finish()  # type: ignore[no-untyped-call]
    with Reader(tmp_path / "a.mcap") as bag:
        [message] = bag.messages()
        assert message.topic.type_name == "lab_msgs/msg/Reading"
        assert (message.publish_time_ns, message.sequence) == (START_NS - 1, 5)
        assert values_of(message.decoded()) == {"header": {"seq": 3, "frame": "map"}, "x": [1.0, 2.0, 3.0]}
        assert bag.summary().problems == ()


def old_database(path: Path, version: int) -> None:
    """Write a database with the tables of a version of rosbag2."""
    with sqlite3.connect(path) as base:
        columns = "id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT"
        columns += ", offered_qos_profiles TEXT" if version >= 2 else ""
        columns += ", type_description_hash TEXT" if version >= 4 else ""
        base.execute(f"CREATE TABLE topics({columns})")
        base.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        values: list[object] = [1, "/chatter", "std_msgs/msg/String", "cdr"]
        values += [qos_text([PROFILE], 8)] if version >= 2 else []
        values += ["RIHS01_0"] if version >= 4 else []
        base.execute(f"INSERT INTO topics VALUES ({', '.join('?' * len(values))})", values)
        for time in (2, 1, 3):
            base.execute("INSERT INTO messages VALUES (NULL, 1, ?, ?)", (START_NS + time, text(str(time))))
        if version >= 3:
            base.execute("CREATE TABLE schema(schema_version INTEGER, ros_distro TEXT)")
            base.execute("INSERT INTO schema VALUES (?, 'humble')", (version,))
        if version >= 4:
            base.execute(
                "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT,"
                " encoded_message_definition TEXT, type_description_hash TEXT)"
            )
            base.execute(
                "INSERT INTO message_definitions"
                " VALUES (1, 'std_msgs/msg/String', 'ros2msg', 'string data', '')"
            )
    base.close()


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_databases_of_all_versions_are_read_and_converted(tmp_path: Path, version: int) -> None:
    """Each version of the tables gives the messages; as MCAP they have a definition and a hash."""
    old_database(tmp_path / "a.db3", version)
    with Reader(tmp_path / "a.db3") as bag, Writer(tmp_path / "new") as writer:
        assert [message.log_time_ns - START_NS for message in bag.messages()] == [1, 2, 3]
        assert [message.log_time_ns - START_NS for message in bag.messages(order="file")] == [2, 1, 3]
        assert [each.decoded() for each in bag.messages(start_ns=START_NS + 3)] == [String(data="3")]
        [topic] = bag.topics
        assert topic.qos_profiles == ((PROFILE,) if version >= 2 else ())
        convert([bag], writer)
    with Reader(tmp_path / "new") as bag:
        [topic] = bag.topics
        assert topic.definition.strip() == "string data"
        assert topic.type_hash.startswith("RIHS01_")
        assert [message.data for message in bag.messages()] == [text("1"), text("2"), text("3")]


TEXT_FOR_A_NUMBER = """
DROP TABLE topics;
CREATE TABLE topics(id TEXT, name, type, serialization_format);
INSERT INTO topics VALUES ('1) OR (1', '/a', 'a/b', 'cdr');
"""


def read_all(path: Path) -> None:
    with Reader(path) as bag:
        bag.summary()
        list(bag.messages())


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("DROP TABLE topics", "lacks the tables 'messages' and 'topics'"),
        ("ALTER TABLE messages RENAME TO old; CREATE VIEW messages AS SELECT * FROM old", "a plain table"),
        ("UPDATE messages SET data = 5", "not a sequence of bytes"),
        ("UPDATE messages SET timestamp = 'soon'", "expected a time"),
        (TEXT_FOR_A_NUMBER, "not a number"),
    ],
)  # fmt: skip
def test_hostile_databases_are_refused(tmp_path: Path, statement: str, reason: str) -> None:
    """Views, other kinds of values and text in place of numbers are InvalidBagErrors; nothing of it runs."""
    old_database(tmp_path / "a.db3", 4)
    with sqlite3.connect(tmp_path / "a.db3") as base:
        base.executescript(statement)
    base.close()
    with pytest.raises(InvalidBagError, match=reason):
        read_all(tmp_path / "a.db3")


def test_a_database_cut_anywhere_is_refused_or_read(tmp_path: Path) -> None:
    """A cut database raises InvalidBagError at the latest when its messages are read."""
    old_database(tmp_path / "a.db3", 4)
    whole = (tmp_path / "a.db3").read_bytes()
    for end in range(0, len(whole), 1500):
        (tmp_path / "cut.db3").write_bytes(whole[:end])
        with pytest.raises(InvalidBagError):
            read_all(tmp_path / "cut.db3")


def test_history_words(tmp_path: Path) -> None:
    """KEEP_ALL is kept as a word that rosbags knows."""
    with Writer(tmp_path / "bag") as bag:
        bag.add_topic(BagTopic.of_class("/a", String, [QoSProfile(history=HistoryPolicy.KEEP_ALL)]))
    with RosbagsReader(tmp_path / "bag") as reader:
        [connection] = reader.connections
        assert connection.ext.offered_qos_profiles[0].history is QosHistory.KEEP_ALL  # type: ignore[union-attr]
