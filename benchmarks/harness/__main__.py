"""`python -m benchmarks.harness '<json parameters>'`: one role of a trial, in this process."""

from __future__ import annotations

import asyncio
import json
import sys
from importlib import import_module
from typing import Any

import actors
from benchmarks.harness.roles import HELD, ROLES
from benchmarks.harness.roles.parent import Parent, report


async def _play(parameters: dict[str, Any]) -> dict[str, Any] | None:
    """Play the role; return its figures, or None if the parent has let go before."""
    role: str = parameters["role"]
    play: Any = getattr(import_module(f"benchmarks.harness.roles.{ROLES[role]}"), role)
    parent = Parent()
    playing = asyncio.ensure_future(play(parameters, parent))
    leaving = asyncio.ensure_future(parent.gone())
    try:
        await asyncio.wait((playing, leaving), return_when=asyncio.FIRST_COMPLETED)
        return await playing if playing.done() or role in HELD else None
    finally:
        playing.cancel()
        leaving.cancel()
        await asyncio.gather(playing, leaving, return_exceptions=True)


def main() -> int:
    """Play a role; return the exit code."""
    parameters: dict[str, Any] = json.loads(sys.argv[1])
    figures = actors.run(lambda: _play(parameters), args=[])
    if figures is None:
        return 1
    report("done", **figures)
    return 0


if __name__ == "__main__":
    sys.exit(main())
