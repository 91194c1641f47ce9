"""Runs calls that may block, such as planning and functions of a description, outside of the event loop."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from contextvars import Context, ContextVar, copy_context
from functools import partial
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")

_abandoned: Final[ContextVar[threading.Event | None]] = ContextVar("abandoned", default=None)


def call_in_thread(call: Callable[[], T], context: Context | None = None) -> asyncio.Future[T]:
    """Call a function in a new thread, in a copy of a context.

    A thread cannot be stopped, so it is a daemon: the interpreter does not wait for it at its end, as it
    would for `asyncio.to_thread`. If the future is cancelled, `abandoned()` is true in the thread.

    Args:
        call: The function.
        context: The context; None: the current one.

    Returns:
        The result of the function, or its exception.
    """
    loop = asyncio.get_running_loop()
    future: asyncio.Future[T] = loop.create_future()
    context = copy_context() if context is None else context.copy()
    flag = threading.Event()

    def finish(set_result: Callable[[], None]) -> None:
        # In the event loop: it may have been cancelled since the thread has finished.
        if not future.done():
            set_result()

    def work() -> None:
        _abandoned.set(flag)
        try:
            set_result = partial(future.set_result, call())
        except BaseException as error:  # noqa: BLE001 - the task that awaits the future gets it
            if isinstance(error, StopIteration):  # a future cannot hold it
                error = RuntimeError(f"StopIteration: {error}").with_traceback(error.__traceback__)
            set_result = partial(future.set_exception, error)
        with suppress(RuntimeError):  # the loop has been closed
            loop.call_soon_threadsafe(finish, set_result)

    future.add_done_callback(lambda _: flag.set())
    threading.Thread(target=context.run, args=(work,), name="launch worker", daemon=True).start()
    return future


def abandoned() -> bool:
    """Return whether the call that runs in this thread has been cancelled."""
    flag = _abandoned.get()
    return flag is not None and flag.is_set()
