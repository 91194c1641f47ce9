"""The graph's documents as JSON. Each is made once for a state of the graph, however many ask for it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.web.json_encoding import encode_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.worker import WorkShare


class Documents:
    """The newest document of each name, as the user may see it.

    Args:
        work: The user's, in which documents are made.
    """

    def __init__(self, work: WorkShare) -> None:
        self._work = work
        self._made: dict[str, tuple[tuple[object, ...], asyncio.Task[bytes]]] = {}

    async def encoded(self, name: str, version: tuple[object, ...], make: Callable[[], object]) -> bytes:
        """Return a document as JSON.

        Args:
            name: One of a few names: a document is kept for each.
            version: The objects of which it is made. As long as they are the same ones, so is the document.
            make: Returns it; called in a thread.

        Raises:
            TooMuchWorkError: See `WorkShare.run`.
        """
        found = self._made.get(name)
        if found is None or not _are_same(found[0], version) or _has_failed(found[1]):
            task = asyncio.get_running_loop().create_task(self._work.run(lambda: encode_json(make())))
            found = self._made[name] = version, task
        # Shielded: others wait for it, too.
        return await asyncio.shield(found[1])


def _are_same(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))


def _has_failed(task: asyncio.Task[bytes]) -> bool:
    return task.done() and (task.cancelled() or task.exception() is not None)
