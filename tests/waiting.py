"""Waits for what sends no event."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

DEADLINE_SEC: Final = 30.0
"""For any single event, on a machine that is busy. Nothing waits this long in vain."""

TURNS: Final = 50
"""Turns of the loop before the first pause: what needs no other process has happened by then."""

LONGEST_PAUSE_SEC: Final = 0.002


async def until(
    condition: Callable[[], object], wanted: str = "", *, deadline_sec: float = DEADLINE_SEC
) -> None:
    """Wait until a condition holds. The pauses between looks at it grow, so that others have the processor.

    Args:
        condition: Called again and again.
        wanted: What it means, for the error.
        deadline_sec: The longest wait.
    """
    pause_sec, turns = 0.0, 0
    try:
        async with asyncio.timeout(deadline_sec):
            while not condition():
                await asyncio.sleep(pause_sec)
                turns += 1
                if turns >= TURNS:
                    pause_sec = min(max(2 * pause_sec, 0.0005), LONGEST_PAUSE_SEC)
    except TimeoutError:
        raise AssertionError(f"This did not happen: {wanted or condition}") from None
