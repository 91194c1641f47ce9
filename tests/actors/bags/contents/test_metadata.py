"""metadata.yaml: writing it, reading each version, and refusing invalid ones."""

from __future__ import annotations

import itertools
from contextlib import suppress
from typing import Any

import pytest
from ruamel.yaml import YAML

from actors.bags.contents.metadata import metadata_text, parse_metadata
from actors.bags.contents.qos_lists import qos_list, qos_profiles, qos_text
from actors.bags.contents.records import BagMetadata, BagTopic, FileSummary, TopicCount
from actors.bags.errors import InvalidBagError
from actors.interfaces.yaml_reader import YamlError
from actors.interfaces.yaml_writer import block_text
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import Duration

START_NS = 1_700_000_000_123_456_789
PROFILE = QoSProfile(
    history=HistoryPolicy.KEEP_ALL,
    depth=3,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    deadline=Duration(nanoseconds=1_500_000_000),
    liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
)
METADATA = BagMetadata(
    version=9,
    storage_identifier="mcap",
    files=(FileSummary("trip_0.mcap", START_NS, 10, 3), FileSummary("trip_1.mcap")),
    topics=(
        TopicCount(BagTopic("/a", "std_msgs/msg/String", type_hash="RIHS01_0", qos_profiles=(PROFILE,)), 3),
        TopicCount(BagTopic("/y", "lab_msgs/msg/Null"), 0),
    ),
    start_ns=START_NS,
    duration_ns=10,
    message_count=3,
    custom_data={"1e3": "null", "text": "two\nlines: and 'quotes'", "empty": ""},
    ros_distro="kilted",
)


def document(version: int) -> dict[str, Any]:
    """Return a metadata.yaml with the fields that rosbag2's parser reads in a version, and no others."""
    topic: dict[str, Any] = {"name": "/a", "type": "std_msgs/msg/String", "serialization_format": "cdr"}
    fields: dict[str, Any] = {
        "version": version,
        "storage_identifier": "sqlite3",
        "relative_file_paths": ["trip/trip_0.db3" if version < 4 else "trip_0.db3"],
        "duration": {"nanoseconds": 10},
        "starting_time": {"nanoseconds_since_epoch": START_NS},
        "message_count": 3,
        "topics_with_message_count": [{"topic_metadata": topic, "message_count": 3}],
    }
    if version >= 3:
        fields |= {"compression_format": "zstd", "compression_mode": "FILE"}
    if version >= 4:
        topic["offered_qos_profiles"] = qos_text([PROFILE], version)
    if version >= 5:
        fields["files"] = [
            {
                "path": "trip_0.db3",
                "starting_time": {"nanoseconds_since_epoch": START_NS},
                "duration": {"nanoseconds": 10},
                "message_count": 3,
            }
        ]
    if version >= 6:
        fields["custom_data"] = {"robot": "r2"}
    if version >= 7:
        topic["type_description_hash"] = "RIHS01_0"
    if version >= 8:
        fields["ros_distro"] = "jazzy"
    if version >= 9:
        topic["offered_qos_profiles"] = qos_list([PROFILE])
    return {"rosbag2_bagfile_information": fields}


def parsed(document: Any) -> BagMetadata:
    return parse_metadata(block_text(document), "metadata.yaml")


def test_what_is_written_is_read_back() -> None:
    """Every value of version 9 is read back, also strings that look like numbers or booleans."""
    assert parse_metadata(metadata_text(METADATA), "metadata.yaml") == METADATA


def test_ros_reads_what_is_written() -> None:
    """A YAML 1.2 reader, as in rosbags, reads the same strings and numbers."""
    fields: Any = YAML(typ="safe").load(metadata_text(METADATA))["rosbag2_bagfile_information"]
    assert fields["custom_data"] == METADATA.custom_data
    assert fields["starting_time"] == {"nanoseconds_since_epoch": START_NS}
    assert fields["topics_with_message_count"][1]["topic_metadata"]["name"] == "/y"
    [profile] = fields["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"]
    assert (profile["history"], profile["deadline"]) == ("keep_all", {"sec": 1, "nsec": 500_000_000})
    assert profile["lifespan"] == {"sec": 9223372036, "nsec": 854775807}


@pytest.mark.parametrize("version", range(1, 10))
def test_all_versions_are_read(version: int) -> None:
    """The fields of each version are read; later ones have their defaults."""
    found = parsed(document(version))
    assert (found.version, found.storage_identifier, found.message_count) == (version, "sqlite3", 3)
    assert (found.start_ns, found.duration_ns) == (START_NS, 10)
    assert [each.path for each in found.files] == ["trip_0.db3"]
    assert found.files[0].message_count == (3 if version >= 5 else 0)
    assert found.compression_mode == ("file" if version >= 3 else "")
    assert found.topics[0].topic.qos_profiles == ((PROFILE,) if version >= 4 else ())
    assert found.topics[0].topic.type_hash == ("RIHS01_0" if version >= 7 else "")
    assert dict(found.custom_data) == ({"robot": "r2"} if version >= 6 else {})
    assert found.ros_distro == ("jazzy" if version >= 8 else "")


def test_files_outside_the_folder_are_never_named() -> None:
    """Only the last part of a path in metadata.yaml is used."""
    changed = document(9)
    changed["rosbag2_bagfile_information"]["relative_file_paths"] = ["../../etc/passwd", "C:\\bags\\b.mcap"]
    assert [each.path for each in parsed(changed).files] == ["passwd", "b.mcap"]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("version", "10", "version 10 is unknown; callboard reads 1 to 9"),
        ("version", "x", "version: expected a number"),
        ("message_count", "-1", "message_count: expected a number"),
        ("message_count", "9" * 5000, "message_count: expected a number"),
        ("message_count", "1" + "0" * 5000, "message_count: expected a number"),
        ("duration", "5", "duration: expected a mapping"),
        ("relative_file_paths", "a.mcap", "relative_file_paths: expected a list"),
        ("relative_file_paths", [".."], "not a file in the bag's folder"),
        ("topics_with_message_count", ["x"], "expected a mapping"),
        ("compression_mode", "some", "neither 'file' nor 'message'"),
        ("custom_data", ["x"], "custom_data: expected a mapping"),
    ],
)
def test_wrong_values_are_refused(name: str, value: Any, reason: str) -> None:
    """A value of a wrong kind raises an InvalidBagError that names file and place."""
    changed = document(9)
    changed["rosbag2_bagfile_information"][name] = value
    with pytest.raises(InvalidBagError, match=f"^metadata.yaml: .*{reason}"):
        parsed(changed)


def test_no_prefix_of_a_document_raises_anything_else() -> None:
    """A file truncated anywhere raises InvalidBagError, unless the rest is complete by itself."""
    text = block_text(document(9))
    for end in range(0, len(text), 3):
        with suppress(InvalidBagError):
            parse_metadata(text[:end], "metadata.yaml")


@pytest.mark.parametrize(
    "text", ["", "[]", "a: b", "- {", "&a [*a]", "a: !!python/object/apply:os.system ['x']"]
)
def test_other_yaml_is_refused(text: str) -> None:
    """Other documents raise InvalidBagError; YAML tags are never resolved."""
    with pytest.raises(InvalidBagError):
        parse_metadata(text, "metadata.yaml")


def test_qos_of_each_version_is_the_same() -> None:
    """All policies are read back, written as words and as numbers."""
    policies = itertools.product(HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy)
    profiles = tuple(
        QoSProfile(
            history=history, depth=5, reliability=reliability, durability=durability, liveliness=liveliness
        )
        for history, reliability, durability, liveliness in policies
    )
    for version in (8, 9):
        assert qos_profiles(qos_text(profiles, version)) == profiles


def test_infinite_times_of_each_middleware_are_no_limit() -> None:
    """The numbers that ROS 2 Foxy wrote for "no limit" are read as such; unknown policies become UNKNOWN."""
    for sec, nsec in ((0x7FFFFFFF, 0xFFFFFFFF), (9223372036, 854775807), (0x7FFFFFFF, 0x7FFFFFFF), (0, 0)):
        [profile] = qos_profiles(
            [{"history": 1, "depth": 0, "deadline": {"sec": sec, "nsec": nsec}, "liveliness": 2}]
        )
        assert profile.deadline == Duration()
        assert profile.history is HistoryPolicy.SYSTEM_DEFAULT
        assert profile.liveliness is LivelinessPolicy.UNKNOWN or profile.liveliness.value == 2


@pytest.mark.parametrize(
    "value", ["{", "x", "[x]", [1], [{"depth": "x"}], [{"depth": 1, "deadline": {"sec": -1}}]]
)
def test_wrong_qos_is_refused(value: Any) -> None:
    """Anything but a list of profiles raises YamlError."""
    with pytest.raises(YamlError):
        qos_profiles(value)
