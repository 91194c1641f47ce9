"""Checks a whole bag: reads all files, verifies their checksums, and decodes each message."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from actors.bags.contents.records import CDR
from actors.bags.errors import BagError, BagNotFoundError
from actors.bags.storage.bag_file import ALL, Order
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.message import type_hash
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actors.bags.contents.records import BagMessage, BagTopic
    from actors.bags.reader import Reader

MAX_PROBLEMS: Final = 100
"""Problems that are listed; further ones are only counted."""


@dataclass
class CheckReport:
    """The result of a check.

    Attributes:
        messages: Number of messages that can be read and decoded, by topic.
        invalid: Number of messages that can be read but not decoded, by topic.
        problems: The problems, each in one sentence; at most `MAX_PROBLEMS`.
        problem_count: Number of all problems.
    """

    messages: Counter[str] = field(default_factory=Counter[str])
    invalid: Counter[str] = field(default_factory=Counter[str])
    problems: list[str] = field(default_factory=list[str])
    problem_count: int = 0

    def add(self, problem: str) -> None:
        """Add a problem."""
        self.problem_count += 1
        if len(self.problems) < MAX_PROBLEMS:
            self.problems.append(problem)


def check(reader: Reader) -> CheckReport:
    """Read a whole bag, and report its problems.

    Args:
        reader: The bag.

    Returns:
        The counts, and the problems: damaged files, messages that cannot be decoded, definitions that are
        invalid or whose hash differs from the stated one, and wrong counts in metadata.yaml.

    Raises:
        BagNotFoundError: There is no bag at the path.
    """
    report = CheckReport()
    counts: Counter[str] = Counter()
    for path in reader.paths:
        try:
            contents = reader.contents_of(path)
            if contents.problem:
                report.add(f"{path}: {contents.problem}")
            _check_messages(reader, path, report, counts)
        except BagError as error:
            if isinstance(error, BagNotFoundError) and path == reader.path:
                raise  # there is no bag; a missing file that metadata.yaml names is a problem of one
            report.add(str(error))
    metadata = reader.metadata
    if metadata is None and reader.path.is_dir():
        report.add(f"{reader.path} has no metadata.yaml; to write it: callboard bag reindex {reader.path}")
    stated: Counter[str] = Counter()
    for each in () if metadata is None else metadata.topics:
        stated[each.topic.name] += each.message_count
    for name, count in stated.items():
        if count != counts[name]:
            report.add(
                f"{name}: metadata.yaml states {count:,} messages, but the files have {counts[name]:,}"
            )
    return report


def _check_messages(reader: Reader, path: Path, report: CheckReport, counts: Counter[str]) -> None:
    decoders: dict[BagTopic, Callable[[BagMessage], object] | None] = {}
    for message in reader.open_file(path).messages(ALL, Order.FILE):
        topic = message.topic
        counts[topic.name] += 1
        if topic not in decoders:
            problem = problem_of(topic)
            decoders[topic] = None if problem else type(message).decoded
            if problem:
                report.add(f"{path}: {topic.name}: {problem}")
        decode = decoders[topic]
        try:
            if decode is not None:
                decode(message)
                report.messages[topic.name] += 1
                continue
        except (InvalidMessageError, MessageBudgetError) as error:
            report.add(f"{path}: {topic.name}, time {message.log_time_ns}: {error}")
        report.invalid[topic.name] += 1


def problem_of(topic: BagTopic) -> str:
    """Return why messages of a topic cannot be decoded, or may be decoded wrongly; "" if neither.

    Args:
        topic: The topic.
    """
    if topic.encoding != CDR:
        return f"its messages are encoded as '{topic.encoding[:40]}'; callboard decodes cdr"
    try:
        found = type_hash(topic.message_class())
    except CallboardError as error:
        return str(error)
    if topic.type_hash and topic.type_hash != found:
        return f"its type hash {topic.type_hash[:71]} differs from that of its definition, {found}"
    return ""
