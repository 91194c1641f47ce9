"""How a child ended, in words."""

from __future__ import annotations

import pytest

from actors.processes.outcome import MAX_REASON_CHARACTERS, outcome_of_error, outcome_of_exit


@pytest.mark.parametrize(
    ("code", "normal", "reason", "exit_code", "signal_name"),
    [
        (0, True, "exit code 0", 0, None),
        (1, False, "exit code 1", 1, None),
        (-9, False, "killed by SIGKILL", None, "SIGKILL"),
        (-250, False, "killed by signal 250", None, "signal 250"),
    ],
)
def test_exits(
    code: int, *, normal: bool, reason: str, exit_code: int | None, signal_name: str | None
) -> None:
    """Only 0 is normal; a signal is named, if it has a name."""
    outcome = outcome_of_exit(code)
    assert (outcome.normal, outcome.reason) == (normal, reason)
    assert (outcome.exit_code, outcome.signal_name) == (exit_code, signal_name)


class MuteError(Exception):
    """Has no text that can be had."""

    def __str__(self) -> str:
        raise RuntimeError("no text")


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (ValueError("no map"), "ValueError: no map"),
        (KeyError(), "KeyError"),
        (MuteError(), "MuteError: (an exception without a readable text)"),
        (ValueError("bad name \udcff"), "ValueError: bad name \\udcff"),
        (ValueError("x" * 1_000_000), "ValueError: ".ljust(MAX_REASON_CHARACTERS, "x")),
    ],
)
def test_errors(error: Exception, reason: str) -> None:
    """The type, and the text if there is one: short, whatever it is, and fit to be sent."""
    outcome = outcome_of_error(error)
    assert (outcome.normal, outcome.reason, outcome.error) == (False, reason, error)
