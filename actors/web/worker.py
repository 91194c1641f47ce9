"""A thread for work that grows with the graph, a type or a message, and would block the event loop.

Python runs one thread at a time: a second one delays the loop by `sys.getswitchinterval` each time, which
`callboard web` makes short. There is one thread for all users, so that the loop has one rival at most, and
each user has one piece of work in it at a time, so that those of many do not delay the others' for long.
"""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Final, ParamSpec, TypeVar

from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
T = TypeVar("T")

SWITCH_SEC: Final = 0.001
"""How long the event loop waits for the thread; a tenth of what a page's request may be delayed."""

MAX_WAITING: Final = 256
"""Pieces of work of one user that wait: more than its requests and panels of one moment."""


class TooMuchWorkError(CallboardError):
    """`MAX_WAITING` pieces of work of this user wait already. Try again in a moment."""


MAX_CONVERSIONS: Final = 2
"""Images of all users that are compressed at the same time, in threads that do not hold up Python."""


class Worker:
    """The thread, which starts with the first piece of work.

    Attributes:
        conversions: Held while an image is compressed.
    """

    def __init__(self) -> None:
        self.conversions = asyncio.Semaphore(MAX_CONVERSIONS)
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="callboard web")

    def share(self) -> WorkShare:
        """Return the share of one more user."""
        return WorkShare(self._pool)

    def close(self) -> None:
        """Drop what waits."""
        self._pool.shutdown(wait=False, cancel_futures=True)


class WorkShare:
    """The work of one user.

    Args:
        pool: Has the thread of all users.
    """

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        self._pool = pool
        self._turn = asyncio.Lock()
        self._waiting = 0

    async def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function in the thread, after what this user has asked for before.

        Args:
            work: The function. It must not touch what the event loop changes.
            *args: Its arguments.
            **kwargs: Its arguments by name.

        Returns:
            What it returns; if it raises, so does this.

        Raises:
            TooMuchWorkError: `MAX_WAITING` of this user wait already.
        """
        if self._waiting >= MAX_WAITING:
            raise TooMuchWorkError(f"{MAX_WAITING} requests of this user wait already; try again in a moment")
        self._waiting += 1
        try:
            async with self._turn:
                return await asyncio.wrap_future(self._pool.submit(work, *args, **kwargs))
        finally:
            self._waiting -= 1
