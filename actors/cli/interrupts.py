"""SIGINT and SIGTERM while no loop runs: they raise. Imports next to nothing, to be ready at once."""

from __future__ import annotations

import signal

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """A signal asks the command to stop.

    Attributes:
        number: The signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def raise_on_signals() -> dict[int, object]:
    """Let signals raise `Interrupted`; return the handlers before. Only the main thread can do so."""
    before: dict[int, object] = {}
    try:
        for number in STOP_SIGNALS:
            before[number] = signal.signal(number, _interrupt)
    except ValueError:  # not in the main thread
        return {}
    return before


def _interrupt(number: int, frame: object) -> None:
    del frame
    raise Interrupted(number)


def put_back(handlers: dict[int, object]) -> None:
    """Undo `raise_on_signals`."""
    for number, handler in handlers.items():
        signal.signal(number, handler)  # type: ignore[arg-type]  # what signal.signal returned


def ignore_signals() -> None:
    """The process ends and is not to be disturbed any more."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
