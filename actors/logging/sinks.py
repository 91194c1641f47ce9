"""Sinks: they accept the records of one logger and of the loggers below it, beside the program's handlers.

A record goes to the sinks of its own logger or, if it has none, of the nearest logger above that has some.

A node publishes its log with one. A handler of the standard module would not do: a logger that has a handler
is no longer written to stderr, and a handler of `a` also gets the records of the node `/a/b`.
"""

from __future__ import annotations

import os
import threading
import weakref
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable, Iterator


class LogSink(Protocol):
    """Something that accepts records."""

    @property
    def target(self) -> object:
        """Where it sends them: of a logger's sinks with equal targets only the first gets a record."""
        ...

    def accept(self, record: logging.LogRecord) -> None:
        """Accept a record, in the thread that logs. It must not raise."""
        ...


class DiscardingSink:
    """Discards records that a sink of a logger above would get otherwise."""

    target = None

    def accept(self, record: logging.LogRecord) -> None:
        """Discard a record."""


# The tuples are replaced, never changed, so that loggers in all threads read them without a lock.
_sinks: Final[dict[str, tuple[weakref.ref[LogSink], ...]]] = {}
_lock = threading.RLock()
"""Held by writers. A garbage collection inside may remove another sink, so it is reentrant."""


def add_sink(name: str, sink: LogSink) -> Callable[[], object]:
    """Give a sink the records of a logger, and of those below it except where a logger between has sinks.

    Args:
        name: The logger's name.
        sink: The sink; only a weak reference is kept.

    Returns:
        A function that removes it.
    """
    # Weak: a node that is dropped without `destroy` must not live on because of its log.
    reference = weakref.ref(sink)
    with _lock:
        _sinks[name] = (*_sinks.get(name, ()), reference)
    remove = weakref.finalize(sink, _remove, name, reference)
    # At the exit of the interpreter nothing has to be removed, and the last lines may be yet to come.
    remove.atexit = False
    return remove


def _remove(name: str, reference: weakref.ref[LogSink]) -> None:
    with _lock:
        # Replaced in one step: a thread that logs meanwhile must not find the name without its other sinks. A
        # reference that is dead is left out, as a garbage collection may have removed its sink meanwhile.
        left = tuple(each for each in _sinks.get(name, ()) if each is not reference and each() is not None)
        if left:
            _sinks[name] = left
        else:  # with `_sinks` empty, a log call does not search at all
            _sinks.pop(name, None)


def sinks_of(name: str) -> Iterator[LogSink]:
    """Iterate over the sinks that get the records of a logger.

    Args:
        name: The logger's name.
    """
    # The nearest logger with sinks, not all above it: the logger of `/a/b` is below that of `/a` by name
    # only. They are different nodes, and the line belongs to one of them.
    while name and _sinks:
        if references := _sinks.get(name):
            targets: list[object] = []
            for reference in references:
                if (sink := reference()) is not None and sink.target not in targets:
                    targets.append(sink.target)
                    yield sink
            return
        name = name.rpartition(".")[0]


def _after_fork_in_child() -> None:
    """Remove all sinks: a child has no connections, and another thread may hold the lock."""
    global _lock  # noqa: PLW0603
    _lock = threading.RLock()
    _sinks.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
