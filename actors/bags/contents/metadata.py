"""metadata.yaml in the folder of a bag: versions 1 to 9 are read, and 9 is written.

rosbag2_bagfile_information:
  version: 9                   added: 3 compression, 4 offered QoS, 5 files, 6 custom_data,
  storage_identifier: mcap     7 type hashes, 8 ros_distro, 9 QoS in words
  duration:
    nanoseconds: 1500000000
  starting_time:
    nanoseconds_since_epoch: 1700000000000000000
  message_count: 3
  topics_with_message_count:
  - topic_metadata: …
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any, Final, cast

from actors.bags.contents.qos_lists import qos_list, qos_profiles
from actors.bags.contents.records import BagMetadata, BagTopic, FileSummary, TopicCount
from actors.bags.errors import InvalidBagError
from actors.interfaces.definition_texts import full_type_name
from actors.interfaces.yaml_reader import PlainText, YamlError, load_yaml
from actors.interfaces.yaml_writer import block_text

FILE_NAME: Final = "metadata.yaml"
VERSION: Final = 9
ROOT: Final = "rosbag2_bagfile_information"
ROS_DISTRO: Final = "callboard"
"""callboard writes this where ROS 2 has the name of its distribution."""
DROPPED_KEY: Final = "callboard.dropped"
"""Name of the lost messages by topic: JSON in custom_data, numbers in a Metadata record of each MCAP file."""
LOSSES_KEY: Final = "callboard.losses"
"""Name of the details about lost messages in custom_data: JSON, by topic."""

MAX_BYTES: Final = 16 * 1024 * 1024
"""Largest metadata.yaml that is read: enough for 50,000 files and topics."""
MAX_ENTRIES: Final = 100_000
"""Limit for the topics, for the files, and for the items of custom_data."""
_MAX_DEPTH: Final = 12
_DIGITS: Final = len(str(1 << 64))
_FILES_SINCE: Final = 5
_EMPTY_START_NS: Final = (1 << 63) - 1
"""The start of a bag without messages, as ROS 2 writes it."""


def metadata_fields(metadata: BagMetadata) -> dict[str, Any]:
    """Return the fields of metadata.yaml below its root; a Metadata record of each MCAP file repeats them."""
    return {
        "version": VERSION,
        "storage_identifier": metadata.storage_identifier,
        "duration": {"nanoseconds": metadata.duration_ns},
        "starting_time": _start(metadata.start_ns, metadata.message_count),
        "message_count": metadata.message_count,
        "topics_with_message_count": [
            {"topic_metadata": _topic(each.topic), "message_count": each.message_count}
            for each in metadata.topics
        ],
        "compression_format": metadata.compression_format,
        "compression_mode": metadata.compression_mode,
        "relative_file_paths": [each.path for each in metadata.files],
        "files": [
            {
                "path": each.path,
                "starting_time": _start(each.start_ns, each.message_count),
                "duration": {"nanoseconds": each.duration_ns},
                "message_count": each.message_count,
            }
            for each in metadata.files
        ],
        "custom_data": dict(metadata.custom_data),
        "ros_distro": metadata.ros_distro or ROS_DISTRO,
    }


def metadata_text(metadata: BagMetadata) -> str:
    """Return the text of metadata.yaml, in version 9.

    Args:
        metadata: The values; their version is ignored.
    """
    return block_text({ROOT: metadata_fields(metadata)})


def _start(start_ns: int, message_count: int) -> dict[str, int]:
    return {"nanoseconds_since_epoch": start_ns if message_count else _EMPTY_START_NS}


def _topic(topic: BagTopic) -> dict[str, Any]:
    return {
        "name": topic.name,
        "type": topic.type_name,
        "serialization_format": topic.encoding,
        "offered_qos_profiles": qos_list(topic.qos_profiles),
        "type_description_hash": topic.type_hash,
    }


def parse_metadata(content: str | bytes, path: str) -> BagMetadata:
    """Return the values of a metadata.yaml.

    Args:
        content: The file's content.
        path: The file's path, for errors.

    Returns:
        The values. Paths of files are reduced to names in the bag's folder. Topics have no definitions: these
        are in the bag's files.

    Raises:
        InvalidBagError: It is not a metadata.yaml, or has a later version.
    """
    return _Parser(path).parse(content)


class _Parser:
    """Reads one file, and names it in errors."""

    def __init__(self, path: str) -> None:
        self._path = path

    def parse(self, content: str | bytes) -> BagMetadata:
        try:
            # Scalars as they are written: a topic or a key named like a number or a boolean stays a string.
            whole = load_yaml(content, rules=PlainText, max_bytes=MAX_BYTES, max_depth=_MAX_DEPTH)
        except YamlError as error:
            place = "" if error.line is None else f"line {error.line}"
            raise InvalidBagError(self._path, place, error.problem) from None
        if not isinstance(whole, Mapping) or ROOT not in whole:
            raise InvalidBagError(self._path, "", f"there is no '{ROOT}'; is it the metadata.yaml of a bag?")
        fields = self._mapping(cast("Mapping[str, object]", whole)[ROOT], ROOT)
        version = self._number(fields, "version")
        if not 1 <= version <= VERSION:
            raise InvalidBagError(
                self._path, "version", f"version {version} is unknown; callboard reads 1 to {VERSION}"
            )
        message_count = self._number(fields, "message_count")
        entries = self._list(fields, "topics_with_message_count")
        return BagMetadata(
            version=version,
            storage_identifier=self._text(fields, "storage_identifier"),
            files=self._files(fields, version),
            topics=tuple(self._topic_count(each) for each in entries),
            start_ns=self._start(fields, message_count),
            duration_ns=self._number(self._mapping(fields.get("duration"), "duration"), "nanoseconds"),
            message_count=message_count,
            compression_format=self._text(fields, "compression_format", ""),
            compression_mode=self._mode(fields),
            custom_data=self._custom_data(fields),
            ros_distro=self._text(fields, "ros_distro", ""),
        )

    def _fail(self, name: str, reason: str) -> InvalidBagError:
        return InvalidBagError(self._path, name, reason)

    def _mapping(self, value: object, name: str) -> Mapping[str, Any]:
        if not isinstance(value, Mapping):
            raise self._fail(name, "expected a mapping")
        return cast("Mapping[str, Any]", value)

    def _list(self, fields: Mapping[str, Any], name: str) -> Sequence[object]:
        value: object = fields.get(name)
        if value is None or value == "":
            return ()
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise self._fail(name, "expected a list")
        items = cast("Sequence[object]", value)
        if len(items) > MAX_ENTRIES:
            raise self._fail(name, f"there are more than {MAX_ENTRIES} entries")
        return items

    def _text(self, fields: Mapping[str, Any], name: str, default: str | None = None) -> str:
        value = fields.get(name, default)
        if not isinstance(value, str):
            raise self._fail(name, "expected a string")
        return "" if isinstance(value, PlainText) and value in {"~", "null"} else str(value)

    def _number(self, fields: Mapping[str, Any], name: str) -> int:
        text = self._text(fields, name).strip()
        if not text.isascii() or not text.isdecimal() or len(text) > _DIGITS or int(text) >= 1 << 64:
            raise self._fail(name, f"expected a number from 0 to 2^64-1, got {text[:40]!r}")
        return int(text)

    def _start(self, fields: Mapping[str, Any], message_count: int) -> int:
        start = self._mapping(fields.get("starting_time"), "starting_time")
        start_ns = self._number(start, "nanoseconds_since_epoch")
        return start_ns if message_count else 0

    def _mode(self, fields: Mapping[str, Any]) -> str:
        mode = self._text(fields, "compression_mode", "").lower()
        if mode not in {"", "none", "file", "message", "storage"}:
            raise self._fail("compression_mode", f"'{mode[:40]}' is neither 'file' nor 'message'")
        # MCAP compresses its chunks itself, and the files say how.
        return "" if mode in {"none", "storage"} else mode

    def _name(self, path: str) -> str:
        """Return a file's name in the folder of the bag."""
        # Bags before version 4 put the folder's name before it, and bags from Windows use backslashes. Only
        # the last part is used, so that metadata.yaml cannot make the reader open a file elsewhere.
        name = PureWindowsPath(path).name if "\\" in path else PurePosixPath(path).name
        if not name or name == "..":
            raise self._fail("relative_file_paths", f"{path[:80]!r} is not a file in the bag's folder")
        return name

    def _files(self, fields: Mapping[str, Any], version: int) -> tuple[FileSummary, ...]:
        texts = (self._text({"path": each}, "path") for each in self._list(fields, "relative_file_paths"))
        names = list(map(self._name, texts))
        known: dict[str, FileSummary] = {}
        for each in self._list(fields, "files") if version >= _FILES_SINCE else ():
            entry = self._mapping(each, "files")
            name = self._name(self._text(entry, "path"))
            count = self._number(entry, "message_count")
            duration = self._number(self._mapping(entry.get("duration"), "duration"), "nanoseconds")
            known[name] = FileSummary(name, self._start(entry, count), duration, count)
        return tuple(known.get(name, FileSummary(name)) for name in names)

    def _topic_count(self, value: object) -> TopicCount:
        entry = self._mapping(value, "topics_with_message_count")
        topic = self._mapping(entry.get("topic_metadata"), "topic_metadata")
        name = self._text(topic, "name")
        try:
            profiles = qos_profiles(topic.get("offered_qos_profiles"))
        except YamlError as error:
            raise self._fail(f"topic {name[:80]}", f"offered_qos_profiles: {error.problem}") from None
        return TopicCount(
            BagTopic(
                name=name,
                type_name=full_type_name(self._text(topic, "type")),
                type_hash=self._text(topic, "type_description_hash", ""),
                qos_profiles=profiles,
                encoding=self._text(topic, "serialization_format"),
            ),
            self._number(entry, "message_count"),
        )

    def _custom_data(self, fields: Mapping[str, Any]) -> Mapping[str, str]:
        value = fields.get("custom_data")
        if value is None or isinstance(value, str):
            return {}
        items = self._mapping(value, "custom_data")
        if len(items) > MAX_ENTRIES:
            raise self._fail("custom_data", f"there are more than {MAX_ENTRIES} entries")
        return {name: self._text(items, name) for name in items}
