"""A callback that has returned a future: it runs, without a task, until the future is done."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable


class CallbackRunner(Protocol):
    """The part of a mailbox that this uses."""

    def task_ended(self, callback: CallbackFuture, /) -> None:
        """Forget a callback that has ended."""
        ...


def is_own_future(result: object) -> bool:
    """Return whether the result of a callback is a future of the running loop.

    Another loop would call what waits for it in its own thread. Awaited in a task, it is an error.
    """
    return isinstance(result, asyncio.Future) and result.get_loop() is asyncio.get_running_loop()


class CallbackFuture:
    """One callback of a `concurrent=True` source, from the future that it has returned to its end.

    Its owner adds it to the running callbacks of the mailbox, so that a stopping node waits for it.

    Args:
        mailbox: The mailbox of the node.
        future: The future.
        ended: Called with the result, or with the exception.
        name: The callback's name, for messages.
    """

    __slots__ = ("_ended", "_future", "_mailbox", "name")

    holding: Final = False
    concurrent: Final = True
    task: Final = None

    def __init__(
        self,
        mailbox: CallbackRunner,
        future: asyncio.Future[Any],
        ended: Callable[[Any, BaseException | None], None],
        name: str,
    ) -> None:
        self.name = name
        self._mailbox = mailbox
        self._future = future
        self._ended = ended
        future.add_done_callback(self._done)

    @property
    def cancelled(self) -> bool:
        """Whether the future was cancelled."""
        return self._future.cancelled()

    def awaits(self, future: object) -> bool:
        """Return whether it runs until this future is done, and that is not done."""
        return self._future is future and not self._future.done()

    def forget(self) -> None:
        """Wait for the future no more; in any thread."""
        self._future.remove_done_callback(self._done)

    def cancel(self) -> None:
        """Cancel the future."""
        self._future.cancel()

    def _done(self, future: asyncio.Future[Any]) -> None:
        self._mailbox.task_ended(self)
        if future.cancelled():
            self._ended(None, asyncio.CancelledError())
        elif (error := future.exception()) is not None:
            self._ended(None, error)
        else:
            self._ended(future.result(), None)
