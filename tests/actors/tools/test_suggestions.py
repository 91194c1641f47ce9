"""Tests of actors.tools.suggestions."""

from __future__ import annotations

from actors.tools.suggestions import did_you_mean


def test_suggestions() -> None:
    """The most similar word, or nothing."""
    assert did_you_mean("/adison", ["/addison", "/other"]) == "; did you mean '/addison'?"
    assert did_you_mean("/x", ["/addison"]) == ""
