"""Lines that others cause are few, and the sum of the others comes by itself."""

from __future__ import annotations

import asyncio

from actors.logging.limited_lines import LimitedLines
from proto.limited_log import MAX_LINES


async def test_the_sum_comes_after_the_last_line() -> None:
    """Case 74: nobody has to cause another line, or end the program, to see how many there were."""
    lines: list[str] = []
    written = asyncio.Event()

    def write(line: str) -> None:
        lines.append(line)
        written.set()

    log = LimitedLines(write, period_sec=0.01)
    while log.admits("a flood"):
        pass
    await asyncio.wait_for(written.wait(), 30)
    assert "more like this: a flood" in lines[0]
    log.close()


async def test_the_end_has_the_rest() -> None:
    """Once, and at once."""
    lines: list[str] = []
    log = LimitedLines(lines.append)
    for _ in range(MAX_LINES + 3):
        log.admits("a flood")
    log.close()
    log.close()
    assert lines == ["… and 3 more like this: a flood"]
