"""Repairs bags: writes metadata.yaml again, and copies the readable part of a damaged bag into a new one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from actors.bags.contents.metadata import DROPPED_KEY
from actors.bags.errors import BagError, BagNotFoundError
from actors.bags.operations.convert import copy_messages
from actors.bags.reader import Reader
from actors.bags.writer import Writer, write_metadata

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.bags.contents.records import BagMessage
    from actors.bags.reader import BagSummary


def reindex(path: str | Path) -> BagSummary:
    """Write the metadata.yaml of a bag from its files.

    Args:
        path: The folder of the bag.

    Returns:
        A summary of the bag. Its problems name files of which a part cannot be read; `recover` repairs them.

    Raises:
        BagError: A file cannot be read.
        BagNotFoundError: The folder does not exist, or has no files of a bag.
        BagWriteError: metadata.yaml cannot be written.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise BagNotFoundError(f"{folder} is not a folder; expected the folder of a bag")
    with Reader(folder, believe_metadata=False) as reader:
        summary = reader.summary(quick=False)
    write_metadata(folder, summary)
    return summary


@dataclass
class RecoverReport:
    """The result of a recovery.

    Attributes:
        kept: Number of messages in the new bag, by topic.
        damages: The parts that could not be read, each in one sentence that names the file.
    """

    kept: Counter[str] = field(default_factory=Counter[str])
    damages: list[str] = field(default_factory=list[str])


def recover(path: str | Path, output: str | Path, *, compression: str = "none") -> RecoverReport:
    """Copy the readable part of a bag into a new one.

    Args:
        path: The bag, or a file of one.
        output: The folder of the new bag.
        compression: Compression of its chunks: "none", "zstd" or "lz4".

    Returns:
        The number of copied messages, and the damages.

    Raises:
        BagError: No part of it can be read.
        BagExistsError: `output` exists.
        BagWriteError: The new bag cannot be written.
    """
    report = RecoverReport()
    with Reader(path, salvage=True, believe_metadata=False) as reader:
        topics = reader.topics  # reads all files, so that no new bag is created if one cannot be read
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
        except BagError as error:  # a SQLite file: after damage, nothing more of it can be read
            report.damages.append(str(error))
            return
        report.kept[message.topic.name] += 1
        yield message
