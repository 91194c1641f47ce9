"""Reads bags of others: `python -m tests.hostile.bag_reader URL FOLDER` runs until it is killed.

It checks, plays and removes whatever comes into the folder. Nothing but an error of callboard may come of it:
with any other the process ends, and its measurement fails.
"""

from __future__ import annotations

import asyncio
import logging
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import actors
from actors.bags import Player, PlayerOptions, Reader
from actors.bags.operations.check import check

PLAYING_SEC: Final = 1.0
"""A bag may last for years."""
PAUSE_SEC: Final = 0.01


def look(path: Path) -> None:
    """Do what `bag info` and `bag check` do."""
    with suppress(actors.CallboardError), Reader(path) as bag:
        bag.summary()
        check(bag)


async def play(path: Path, url: str) -> None:
    """Play the beginning of a bag."""
    with suppress(actors.CallboardError):
        async with Player(path, options=PlayerOptions(rate=1000), url=url) as player:
            with suppress(TimeoutError):
                await asyncio.wait_for(player.wait(), PLAYING_SEC)


async def main() -> None:
    """Print a line once it begins."""
    url, folder = sys.argv[1], Path(sys.argv[2])
    logging.getLogger("callboard").setLevel(logging.CRITICAL)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        for path in await asyncio.to_thread(lambda: sorted(folder.iterdir())):
            await asyncio.to_thread(look, path)
            await play(path, url)
            await asyncio.to_thread(path.unlink)
        await asyncio.sleep(PAUSE_SEC)


if __name__ == "__main__":
    asyncio.run(main())
