"""Checks a bag without playing it: everything is read, and each message is decoded."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from actors.bags.errors import BagError
from actors.bags.files import ALL, Order
from actors.bags.records import CDR
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.message import type_hash
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from actors.bags.reader import Reader
    from actors.bags.records import BagMessage, BagTopic

MAX_PROBLEMS: Final = 100
"""Problems that are told; the others are counted."""


@dataclass
class CheckReport:
    """What a check has found.

    Attributes:
        messages: Messages that can be read and decoded, by topic.
        invalid: Messages that can be read and not decoded, by topic.
        problems: What is wrong, each in one sentence; at most `MAX_PROBLEMS`.
        problem_count: How many there are.
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
    """Read a whole bag, and say what is wrong with it.

    Args:
        reader: The bag.

    Returns:
        What was found: damaged files, messages that are no messages of their type, definitions of which no
        class can be made or whose hash differs from the stated one, and wrong numbers in metadata.yaml.
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
            report.add(str(error))
    metadata = reader.metadata
    if metadata is None and reader.path.is_dir():
        report.add(f"{reader.path} has no metadata.yaml; callboard bag reindex {reader.path} writes it")
    stated: Counter[str] = Counter()
    for each in () if metadata is None else metadata.topics:
        stated[each.topic.name] += each.message_count
    for name, count in stated.items():
        if count != counts[name]:
            report.add(
                f"{name}: metadata.yaml states {count:,} messages, and the files have {counts[name]:,}"
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
    """Return why messages of a topic cannot be decoded, or are in doubt; "" if they can.

    Args:
        topic: The topic.
    """
    if topic.encoding != CDR:
        return f"its messages are in '{topic.encoding[:40]}'; callboard decodes cdr"
    try:
        found = type_hash(topic.message_class())
    except CallboardError as error:
        return str(error)
    if topic.type_hash and topic.type_hash != found:
        return f"its type hash {topic.type_hash[:71]} is not that of its definition, {found}"
    return ""
