"""Suggestions for misspelt words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean '…'?" with the most similar known word; empty if none is similar.

    Args:
        word: The unknown word.
        known: The words that are valid.
    """
    import difflib  # noqa: PLC0415 - only after a mistake

    close = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean '{close[0]}'?" if close else ""
