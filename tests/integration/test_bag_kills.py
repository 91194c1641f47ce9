"""Recorders that are killed: what the operating system had is in the files, and others can read them."""

from __future__ import annotations

import asyncio
import contextlib
import random
import struct
from typing import TYPE_CHECKING, Final

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

from actors.bags import Reader
from actors.bags.contents.metadata import parse_metadata
from actors.bags.operations.check import check
from actors.bags.operations.recover import recover
from actors.interfaces import cdr
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.std_msgs.msg import String
from tests.actors.bags.recorder.recordings import files_of, messages_of
from tests.integration.bag_victim import TOPICS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from tests.integration.conftest import System

KILLS: Final = 4
NIGHTLY_KILLS: Final = 20
AT_ONCE: Final = 4
SIGKILLED: Final = -9
CUT: Final = (McapError, struct.error, InvalidMessageError)
"""What the end of a file causes that was cut within a chunk: the library yields the rest of a message."""


def numbers_in(file: Path) -> Iterator[tuple[str, int]]:
    """Yield topics and numbers of a file's messages, as far as a reader that does not seek can read it."""
    with file.open("rb") as stream, contextlib.suppress(*CUT):
        for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            yield channel.topic, int(cdr.decode(String, message.data).data.split()[0])


def by_topic(numbers: Iterable[tuple[str, int]]) -> dict[str, list[int]]:
    """Return the numbers of each topic."""
    found: dict[str, list[int]] = {name: [] for name in TOPICS}
    for topic, number in numbers:
        found[topic].append(number)
    return found


async def outlive(system: System, bag: Path, seconds: float) -> tuple[int, dict[str, list[int]]]:
    """Let a recorder be killed; return how many messages it had written, and those in its files."""
    victim = await system.python("-m", "tests.integration.bag_victim", str(bag), str(seconds))
    assert await victim.wait_for_exit() == SIGKILLED
    reported = [int(line) for line in victim.lines if line.isdigit()][-1]
    return reported, by_topic(each for file in files_of(bag) for each in numbers_in(file))


def recovered(bag: Path) -> dict[str, list[int]]:
    """Recover a bag, and return what it has then: as much as is said of each topic, without damage."""
    output = bag.with_name(f"{bag.name}_recovered")
    report = recover(bag, output)
    kept = by_topic((each.topic, int(each.decoded(String).data.split()[0])) for each in messages_of(output))
    assert report.kept == {name: len(numbers) for name, numbers in kept.items()}
    metadata = parse_metadata((output / "metadata.yaml").read_bytes(), str(output))
    assert {each.topic.name: each.message_count for each in metadata.topics} == report.kept
    with Reader(output) as reader:
        checked = check(reader)
    assert (checked.messages, checked.problems) == (report.kept, [])
    return kept


@pytest.mark.timeout(300)
async def test_what_was_flushed_survives_a_kill(
    system: System, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Case 35: at random moments under load, with splits: all of it, in order, nothing twice.

    A bag that is recovered from it has exactly what is said of each topic: all whole chunks.
    """
    seed = random.randrange(2**32)
    print(f"seed {seed}")  # noqa: T201 - pytest shows it if the test fails
    chance = random.Random(seed)
    kills = NIGHTLY_KILLS if request.config.getoption("--nightly") else KILLS
    moments = [chance.uniform(0, 1.5) for _ in range(kills)]
    for first in range(0, kills, AT_ONCE):
        bags = [tmp_path / f"trip{index}" for index in range(first, first + AT_ONCE)]
        victims = (outlive(system, bag, moment) for bag, moment in zip(bags, moments[first:], strict=False))
        results = await asyncio.gather(*victims)
        for bag, (reported, found) in zip(bags, results, strict=True):
            assert reported > 0
            assert sum(map(len, found.values())) >= reported
            kept = recovered(bag)
            assert sum(map(len, kept.values())) >= reported
            for topic, numbers in found.items():
                assert numbers == list(range(len(numbers)))
                # The other library also yields messages of a last chunk that is not whole.
                assert kept[topic] == numbers[: len(kept[topic])]
