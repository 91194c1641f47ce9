"""Reads the files of a recorder with the library `mcap`, independently of callboard's reader."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from mcap.reader import make_reader

from actors.interfaces import cdr

if TYPE_CHECKING:
    from pathlib import Path

    from actors.interfaces.message import Message


class Recorded(NamedTuple):
    """A message of a file."""

    topic: str
    type_name: str
    data: bytes
    log_time: int
    publish_time: int
    sequence: int

    def decoded(self, msg_type: type[Message]) -> Any:
        """Return the decoded message."""
        return cdr.decode(msg_type, self.data)


def files_of(bag: Path) -> list[Path]:
    """Return the files of a bag, in their order."""
    return sorted(bag.glob("*.mcap"), key=lambda each: int(each.stem.rpartition("_")[2]))


def messages_of(bag: Path) -> list[Recorded]:
    """Return the messages of a bag, or of a single file, in the order of the files."""
    return [each for file in ([bag] if bag.is_file() else files_of(bag)) for each in _messages(file)]


def _messages(file: Path) -> list[Recorded]:
    with file.open("rb") as stream:
        return [
            Recorded(
                channel.topic,
                schema.name,
                message.data,
                message.log_time,
                message.publish_time,
                message.sequence,
            )
            for schema, channel, message in make_reader(stream).iter_messages()
            if schema is not None
        ]
