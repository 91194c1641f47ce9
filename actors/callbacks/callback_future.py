"""Callbacks that have returned and end later, without a task: when a future is done, or in another thread."""

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


class LateCallback:
    """One callback of a `concurrent=True` source, from its return to the end of its work.

    Its owner adds it to the running callbacks of the mailbox, so that a stopping node waits for it.

    Attributes:
        name: The callback's name, for messages.
    """

    __slots__ = ("name",)

    holding: Final = False
    concurrent: Final = True
    task: Final = None

    def __init__(self, name: str = "") -> None:
        self.name = name

    def cancel(self) -> None:
        """End it."""
        raise NotImplementedError


class CallbackFuture(LateCallback):
    """A callback that has returned a future.

    Args:
        mailbox: The mailbox of the node.
        future: The future.
        ended: Called with the result, or with the exception.
        name: The callback's name, for messages.
    """

    __slots__ = ("_ended", "_future", "_mailbox")

    def __init__(
        self,
        mailbox: CallbackRunner,
        future: asyncio.Future[Any],
        ended: Callable[[Any, BaseException | None], None],
        name: str,
    ) -> None:
        super().__init__(name)
        self._mailbox = mailbox
        self._future = future
        self._ended = ended
        future.add_done_callback(self._done)

    @property
    def cancelled(self) -> bool:
        """Whether the future was cancelled."""
        return self._future.cancelled()

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
