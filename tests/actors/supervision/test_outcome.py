"""How a child ended, in words."""

from __future__ import annotations

import pytest

from actors.supervision.outcome import outcome_of_error, outcome_of_exit


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


@pytest.mark.parametrize(
    ("error", "reason"), [(ValueError("no map"), "ValueError: no map"), (KeyError(), "KeyError")]
)
def test_errors(error: Exception, reason: str) -> None:
    """The type, and the text if there is one."""
    outcome = outcome_of_error(error)
    assert (outcome.normal, outcome.reason, outcome.error) == (False, reason, error)
