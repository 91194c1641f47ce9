"""Topics and messages of a bag, and the values of metadata.yaml. Plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from actors.interfaces import cdr
from actors.interfaces.definition_texts import ROS2MSG, class_of_definition, definition_text, has_stated_hash
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.fields import fields_of
from actors.interfaces.message import type_hash, type_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from typing_extensions import Buffer

    from actors.interfaces.message import Message
    from actors.qos.profile import QoSProfile

CDR = "cdr"
"""The encoding of ROS 2's messages, the only one that callboard decodes."""

_MAX_EMPTY_BYTES = 8
"""Bytes of a message without fields: a header of four, and one, which is filled up to four."""


@dataclass(frozen=True)
class BagTopic:
    """A topic in a bag. Topics with the same name and another type or definition are separate topics.

    Attributes:
        name: The topic's name.
        type_name: Such as "std_msgs/msg/String".
        definition: The definition of the type and of the types that it uses; "" if the bag has none.
        definition_format: "ros2msg" or "ros2idl".
        type_hash: "RIHS01_…", or "".
        qos_profiles: The QoS that its publishers offered.
        encoding: How its messages are encoded, such as "cdr".
    """

    name: str
    type_name: str
    definition: str = field(default="", repr=False)
    definition_format: str = ROS2MSG
    type_hash: str = ""
    qos_profiles: tuple[QoSProfile, ...] = ()
    encoding: str = CDR

    @classmethod
    def of_class(
        cls, name: str, msg_type: type[Message], qos_profiles: Iterable[QoSProfile] = ()
    ) -> BagTopic:
        """Return the topic for messages of a class.

        Args:
            name: The topic's name.
            msg_type: The class; its definition is written from its fields.
            qos_profiles: The QoS that its publishers offer.
        """
        full_name = type_name(msg_type)
        found = type_hash(msg_type) if has_stated_hash(full_name) else ""
        return cls(name, full_name, definition_text(msg_type), ROS2MSG, found, tuple(qos_profiles))

    @property
    def key(self) -> tuple[str, str, str]:
        """Name, type and definition, which together identify the topic."""
        return self.name, self.type_name, self.definition

    def message_class(self) -> type[Message]:
        """Return the class of its messages: the installed one if its definition is the same, or a new one.

        Raises:
            InterfaceSyntaxError: The definition breaks a rule.
            InvalidMessageError: No class can be made from the definition.
            UnknownInterfaceError: The bag has no definition, and the type is not installed.
        """
        found = class_of_definition(self.type_name, self.definition, self.definition_format)
        if self._is_empty(found) and self.type_hash and type_hash(found) != self.type_hash:
            raise UnknownInterfaceError(self._lacks_definition)
        return found

    def decoder(self) -> Callable[[Buffer], Message]:
        """Return what decodes its messages from CDR.

        It raises InvalidMessageError for bytes that are not of this type. If the bag has an empty definition
        and the type is not installed, those are all that have contents.

        Raises:
            InterfaceSyntaxError, InvalidMessageError, UnknownInterfaceError: As for `message_class`.
        """
        cls = self.message_class()
        decode: Callable[[Buffer], Message] = cdr.codec_for(cls).decode
        if not self._is_empty(cls):
            return decode

        def decode_empty(data: Buffer) -> Message:
            if memoryview(data).nbytes > _MAX_EMPTY_BYTES:
                raise InvalidMessageError(self._lacks_definition)
            return decode(data)

        return decode_empty

    def _is_empty(self, cls: type[Message]) -> bool:
        """Return whether there is no definition, or that of a message without fields: both are empty."""
        return (not self.definition or self.definition.isspace()) and not fields_of(cls)

    @property
    def _lacks_definition(self) -> str:
        return f"The bag has an empty definition of {self.type_name}, and it is not installed here"


class BagMessage(NamedTuple):
    """A message of a bag, as it was recorded."""

    topic: BagTopic
    data: bytes
    """CDR, with its header of four bytes."""
    log_time_ns: int
    """Time of reception, in nanoseconds since 1970."""
    publish_time_ns: int
    """Time of publication, in nanoseconds since 1970."""
    sequence: int = 0
    """The publisher's number for the message; 0 if the recorder stored none."""

    def decoded(self) -> Message:
        """Return the message.

        Raises:
            InterfaceSyntaxError: As for `BagTopic.message_class`.
            InvalidMessageError: The bytes are not a message of the type; or as for `BagTopic.message_class`.
            UnknownInterfaceError: As for `BagTopic.message_class`.
        """
        return self.topic.decoder()(self.data)


@dataclass(frozen=True)
class TopicCount:
    """A topic and the number of its messages."""

    topic: BagTopic
    message_count: int


@dataclass(frozen=True)
class FileSummary:
    """A file of a bag.

    Attributes:
        path: The file's name in the folder of the bag.
        start_ns: Log time of its first message; 0 if it has none.
        duration_ns: Time from its first to its last message.
        message_count: Number of its messages.
    """

    path: str
    start_ns: int = 0
    duration_ns: int = 0
    message_count: int = 0


@dataclass(frozen=True)
class BagMetadata:
    """The values of metadata.yaml.

    Attributes:
        version: Version of the file format, 1 to 9.
        storage_identifier: "mcap" or "sqlite3".
        files: The files in order; versions before 5 have only their paths.
        topics: The topics, with the number of their messages.
        start_ns: Log time of the first message; 0 if there is none.
        duration_ns: Time from the first to the last message.
        message_count: Number of all messages.
        compression_format: Such as "zstd"; "" if nothing is compressed (chunks of MCAP aside).
        compression_mode: "file" or "message", or "".
        custom_data: Strings that the user or the recorder stored, by name.
        ros_distro: Name of the ROS 2 distribution, such as "kilted"; "callboard" if callboard wrote the bag.
    """

    version: int
    storage_identifier: str
    files: tuple[FileSummary, ...] = ()
    topics: tuple[TopicCount, ...] = ()
    start_ns: int = 0
    duration_ns: int = 0
    message_count: int = 0
    compression_format: str = ""
    compression_mode: str = ""
    custom_data: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    ros_distro: str = ""
