"""SIGINT and SIGTERM while no loop runs: they are noted, and looked for before the command goes on.

A handler that raises would be unsafe there: what it raises inside an import or a finalizer may be swallowed,
and the signal with it. What is done without a loop is short; a second signal raises all the same. This module
imports next to nothing, so as to be ready at once.
"""

from __future__ import annotations

import signal

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_noted: list[int] = []
_at_once = False


class Interrupted(KeyboardInterrupt):
    """A signal asks the command to stop.

    Attributes:
        number: The signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def note_signals() -> dict[int, object]:
    """Let signals be noted; return the handlers before. Only the main thread can do so."""
    global _at_once  # noqa: PLW0603 - signals belong to the process
    before: dict[int, object] = {}
    try:
        for number in STOP_SIGNALS:
            before[number] = signal.signal(number, _note)
    except ValueError:  # not in the main thread
        return {}
    _noted.clear()
    _at_once = False
    return before


def _note(number: int, frame: object) -> None:
    del frame
    _noted.append(number)
    if _at_once or len(_noted) > 1:
        raise Interrupted(number)


def noted() -> int | None:
    """Return the first signal that has come."""
    return _noted[0] if _noted else None


def raise_if_noted() -> None:
    """Raise `Interrupted` if a signal has come."""
    if _noted:
        raise Interrupted(_noted[0])


def raise_at_once() -> None:
    """From now on a signal raises where it comes; one that has come raises here."""
    global _at_once  # noqa: PLW0603 - signals belong to the process
    _at_once = True
    raise_if_noted()


def put_back(handlers: dict[int, object]) -> None:
    """Undo `note_signals`."""
    for number, handler in handlers.items():
        signal.signal(number, handler)  # type: ignore[arg-type]  # what signal.signal returned


def ignore_signals() -> None:
    """The process ends and is not to be disturbed any more."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
