"""The reference of the command line, which is made from its parsers."""

from __future__ import annotations

from pathlib import Path

from actors.cli.reference import reference

DOCUMENT = Path(__file__).resolve().parents[3] / "docs" / "reference" / "cli.md"


def test_the_command_line_reference_matches_the_parsers() -> None:
    """After a change: python -m actors.cli.reference > docs/reference/cli.md."""
    assert DOCUMENT.read_text(encoding="utf-8") == reference()
