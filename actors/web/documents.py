"""The graph's documents as JSON. Each is made once for a state of the graph, however many ask for it."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

from actors.web.json_encoding import encode_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.worker import WorkShare

PAUSE: Final = 10
"""How many times as long as a document took it is not made again, while the graph changes all the time."""


class _Document:
    """A document that is being made, or has been.

    Args:
        not_before_sec: When it may be made.
    """

    def __init__(self, not_before_sec: float) -> None:
        self.not_before_sec = not_before_sec
        self.parts: tuple[object, ...] | None = None
        """The objects of which it is made; None until it is."""
        self.again_sec = not_before_sec
        self.task: asyncio.Task[bytes] | None = None

    def fits(self, parts: tuple[object, ...]) -> bool:
        """Return whether it is what somebody gets who asks now."""
        if self.parts is None:
            return True
        if self.task is None or (self.task.done() and (self.task.cancelled() or self.task.exception())):
            return False
        return all(a is b for a, b in zip(self.parts, parts, strict=True))


class Documents:
    """The newest document of each name, as the user may see it.

    Args:
        work: The user's, in which documents are made.
    """

    def __init__(self, work: WorkShare) -> None:
        self._work = work
        self._made: dict[str, _Document] = {}

    async def encoded(
        self, name: str, parts: Callable[[], tuple[Any, ...]], make: Callable[..., object]
    ) -> bytes:
        """Return a document as JSON, of what is there now or a little later.

        Args:
            name: One of a few names: a document is kept for each.
            parts: Returns the objects of which it is made. As long as they are the same, so is the document.
            make: Returns the document of these; called in a thread.

        Raises:
            TooMuchWorkError: See `WorkShare.run`.
        """
        found = self._made.get(name)
        if found is None or not found.fits(parts()):
            found = self._made[name] = _Document(0.0 if found is None else found.again_sec)
            found.task = asyncio.get_running_loop().create_task(self._make(found, parts, make))
        assert found.task is not None
        # Shielded: others wait for it, too.
        return await asyncio.shield(found.task)

    async def _make(
        self, document: _Document, parts: Callable[[], tuple[Any, ...]], make: Callable[..., object]
    ) -> bytes:
        await asyncio.sleep(document.not_before_sec - time.monotonic())
        document.parts = parts()
        encoded, spent_sec = await self._work.run(_timed, make, document.parts)
        document.again_sec = time.monotonic() + PAUSE * spent_sec
        return encoded


def _timed(make: Callable[..., object], parts: tuple[Any, ...]) -> tuple[bytes, float]:
    """Return a document, and the seconds of this thread that it took."""
    began = time.thread_time()
    encoded = encode_json(make(*parts))
    return encoded, time.thread_time() - began
