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

from actors.interfaces import cdr
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.std_msgs.msg import String
from tests.actors.bags.recorder.recordings import files_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.integration.conftest import System

KILLS: Final = 4
NIGHTLY_KILLS: Final = 20
AT_ONCE: Final = 4
SIGKILLED: Final = -9
CUT: Final = (McapError, struct.error, InvalidMessageError)
"""What the end of a file causes that was cut within a chunk: the library yields the rest of a message."""


def numbers_in(file: Path) -> Iterator[int]:
    """Yield the numbers of a file's messages, as far as a reader that does not seek can read it."""
    with file.open("rb") as stream, contextlib.suppress(*CUT):
        for _, _, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            yield int(cdr.decode(String, message.data).data.split()[0])


async def outlive(system: System, bag: Path, seconds: float) -> tuple[int, list[int]]:
    """Let a recorder be killed; return how many messages it had written, and those in its files."""
    victim = await system.python("-m", "tests.integration.bag_victim", str(bag), str(seconds))
    assert await victim.wait_for_exit() == SIGKILLED
    reported = [int(line) for line in victim.lines if line.isdigit()][-1]
    return reported, [number for file in files_of(bag) for number in numbers_in(file)]


@pytest.mark.timeout(300)
async def test_what_was_flushed_survives_a_kill(
    system: System, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Case 35: at random moments under load, with splits: all of it, in order, nothing twice."""
    seed = random.randrange(2**32)
    print(f"seed {seed}")  # noqa: T201 - pytest shows it if the test fails
    chance = random.Random(seed)
    kills = NIGHTLY_KILLS if request.config.getoption("--nightly") else KILLS
    moments = [chance.uniform(0, 1.5) for _ in range(kills)]
    for first in range(0, kills, AT_ONCE):
        results = await asyncio.gather(
            *(
                outlive(system, tmp_path / f"trip{index}", moments[index])
                for index in range(first, first + AT_ONCE)
            )
        )
        for reported, found in results:
            assert reported > 0
            assert len(found) >= reported
            assert found == sorted(set(found))
            assert found[:reported] == list(range(reported))
