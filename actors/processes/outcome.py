"""The outcome of a child: how it ended, and why."""

from __future__ import annotations

import signal
from dataclasses import dataclass
from typing import Final

from actors.errors import error_text

MAX_REASON_CHARACTERS: Final = 500
"""The longest reason: reasons are logged, kept and published."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a child ended.

    Attributes:
        normal: Whether it returned, exited with 0, or was stopped by its supervisor.
        reason: Why, in a few words: "exit code 1", "killed by SIGKILL", "ValueError: no such map". At most
            `MAX_REASON_CHARACTERS`, without lone surrogates.
        exit_code: The exit code of a process that exited; None for others.
        signal_name: The signal that killed a process ("SIGKILL"); None for others.
        returncode: A process's exit code, or minus the number of the signal that killed it; None for others.
        error: The exception that ended something in this process.
    """

    normal: bool
    reason: str
    exit_code: int | None = None
    signal_name: str | None = None
    returncode: int | None = None
    error: BaseException | None = None


def outcome_of_exit(code: int) -> Outcome:
    """Return the outcome of a process; a negative code is minus a signal's number."""
    if code >= 0:
        return Outcome(normal=code == 0, reason=f"exit code {code}", exit_code=code, returncode=code)
    try:
        name = signal.Signals(-code).name
    except ValueError:  # a real-time signal
        name = f"signal {-code}"
    return Outcome(normal=False, reason=f"killed by {name}", signal_name=name, returncode=code)


def outcome_of_error(error: BaseException) -> Outcome:
    """Return the outcome of something in this process that raised."""
    name, text = type(error).__name__, error_text(error)
    reason = f"{name}: {text}" if text else name
    return Outcome(normal=False, reason=reason[:MAX_REASON_CHARACTERS], error=error)
