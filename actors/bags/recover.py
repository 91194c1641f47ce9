"""Repairs: writes the metadata.yaml of a bag, and what is whole of a damaged bag into a new one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from actors.bags.convert import copy_messages
from actors.bags.errors import BagError, BagNotFoundError
from actors.bags.metadata import VERSION
from actors.bags.reader import Reader
from actors.bags.records import BagMetadata
from actors.bags.writer import DROPPED_KEY, Writer, write_metadata

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.bags.reader import BagSummary
    from actors.bags.records import BagMessage


def reindex(path: str | Path) -> BagSummary:
    """Write the metadata.yaml of a bag from what its files have.

    Args:
        path: The folder of the bag.

    Returns:
        What it has; its problems name files of which not all can be read. `recover` helps there.

    Raises:
        BagError: A file cannot be read.
        BagNotFoundError: There is no such folder, or it has no files of a bag.
        BagWriteError: metadata.yaml cannot be written.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise BagNotFoundError(f"{folder} is no folder; callboard bag reindex takes the folder of a bag")
    with Reader(folder, believe_metadata=False) as reader:
        summary = reader.summary(quick=False)
    write_metadata(
        folder,
        BagMetadata(
            version=VERSION,
            storage_identifier=summary.storage_identifier,
            files=summary.files,
            topics=summary.topics,
            start_ns=summary.start_ns,
            duration_ns=summary.duration_ns,
            message_count=summary.message_count,
            compression_format=summary.compression_format,
            compression_mode=summary.compression_mode,
            custom_data=summary.custom_data,
            ros_distro=summary.ros_distro,
        ),
    )
    return summary


@dataclass
class RecoverReport:
    """What was recovered.

    Attributes:
        kept: The messages in the new bag, by topic.
        damages: What could not be read, each in one sentence with its file.
    """

    kept: Counter[str] = field(default_factory=Counter[str])
    damages: list[str] = field(default_factory=list[str])


def recover(path: str | Path, output: str | Path, *, compression: str = "none") -> RecoverReport:
    """Write what is whole of a bag into a new one.

    Args:
        path: The bag, or a file of one.
        output: The folder of the new bag.
        compression: Of its chunks: "none", "zstd" or "lz4".

    Returns:
        What was kept, and what is damaged.

    Raises:
        BagError: Nothing of it can be read.
        BagExistsError: There is something at `output`.
        BagWriteError: The new bag cannot be written.
    """
    report = RecoverReport()
    with Reader(path, salvage=True, believe_metadata=False) as reader:
        topics = reader.topics  # reads all files, so that one that is no bag makes no new one
        summary = reader.summary(quick=False)
        custom_data = {name: text for name, text in summary.custom_data.items() if name != DROPPED_KEY}
        with Writer(output, compression=compression, custom_data=custom_data) as writer:
            writer.set_losses(summary.dropped)
            for topic in topics:
                writer.add_topic(topic)
            copy_messages(_counted(reader.messages(), report), writer)
        for file, problems in reader.damages.items():
            report.damages += [f"{file}: {problem}" for problem in problems]
    return report


def _counted(messages: Iterator[BagMessage], report: RecoverReport) -> Iterator[BagMessage]:
    while True:
        try:
            message = next(messages)
        except StopIteration:
            return
        except BagError as error:  # a database, of which the rest cannot be read
            report.damages.append(str(error))
            return
        report.kept[message.topic.name] += 1
        yield message
