"""SIGINT and SIGTERM while no loop runs: they are recorded_signal, and looked for before the command goes on.

A handler that raises would be unsafe there: what it raises inside an import or a finalizer may be swallowed,
and the signal with it. What is done without a loop is short; a second signal raises all the same. This module
imports next to nothing, so as to be ready at once.
"""

from __future__ import annotations

import signal

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_recorded: list[int] = []
_at_once = False


class Interrupted(KeyboardInterrupt):
    """A signal asks the command to stop.

    Attributes:
        number: The signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def record_signals() -> dict[int, object]:
    """Let signals be recorded_signal; return the handlers before. Only the main thread can do so."""
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
    _recorded.append(number)
    if _at_once or len(_recorded) > 1:
        raise Interrupted(number)


def recorded_signal() -> int | None:
    """Return the first signal that has come."""
    return _recorded[0] if _recorded else None


def raise_if_signalled() -> None:
    """Raise `Interrupted` if a signal has come."""
    if _recorded:
        raise Interrupted(_recorded[0])


def raise_at_once() -> None:
    """From now on a signal raises where it comes; one that has come raises here."""
    global _at_once  # noqa: PLW0603 - signals belong to the process
    _at_once = True
    raise_if_signalled()


def restore_handlers(handlers: dict[int, object]) -> None:
    """Undo `record_signals`."""
    for number, handler in handlers.items():
        signal.signal(number, handler)  # type: ignore[arg-type]  # what signal.signal returned


def ignore_signals() -> None:
    """The process ends and is not to be disturbed any more."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
