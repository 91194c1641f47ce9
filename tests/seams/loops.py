"""What an event loop of a test needs of asyncio's handles, where no public name has it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from contextvars import Context

run_handle: Final = asyncio.Handle._run
"""Runs a handle's callback in its context: what a loop does in each of its turns."""


def context_in(handle: asyncio.Handle) -> Context:
    """Return a handle's context, which is public since Python 3.12 only."""
    context: Context = handle._context  # type: ignore[attr-defined]
    return context
