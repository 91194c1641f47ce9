"""SIGINT and SIGTERM while no event loop runs: they are recorded, and checked before the command continues.

A handler that raises would be unsafe there: an import or a finalizer may swallow its exception, and the
signal would be lost. Commands do little without a loop; a second signal raises at once. This module imports
nearly nothing, so that it is ready early.
"""

from __future__ import annotations

import signal

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_recorded: list[int] = []
_at_once = False


class Interrupted(KeyboardInterrupt):
    """A signal stopped the command.

    Attributes:
        number: The signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def record_signals() -> dict[int, object]:
    """Record signals; return the handlers before. Does nothing outside the main thread."""
    global _at_once  # noqa: PLW0603 - signals belong to the process
    before: dict[int, object] = {}
    try:
        for number in STOP_SIGNALS:
            before[number] = signal.signal(number, _record)
    except ValueError:  # not in the main thread
        return {}
    _recorded.clear()
    _at_once = False
    return before


def _record(number: int, frame: object) -> None:
    del frame
    # The second one raises even where that is unsafe: the user must always be able to end the command.
    _recorded.append(number)
    if _at_once or len(_recorded) > 1:
        raise Interrupted(number)


def recorded_signal() -> int | None:
    """Return the first recorded signal."""
    return _recorded[0] if _recorded else None


def raise_if_signalled() -> None:
    """Raise `Interrupted` if a signal was recorded."""
    if _recorded:
        raise Interrupted(_recorded[0])


def raise_at_once() -> None:
    """Raise at signals from now on, and here for a recorded one."""
    global _at_once  # noqa: PLW0603 - signals belong to the process
    _at_once = True
    raise_if_signalled()


def restore_handlers(handlers: dict[int, object]) -> None:
    """Undo `record_signals`."""
    for number, handler in handlers.items():
        signal.signal(number, handler)  # type: ignore[arg-type]  # what signal.signal returned


def ignore_signals() -> None:
    """Ignore further signals: the process is exiting."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
