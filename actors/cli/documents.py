r"""Documents in a stream of text: YAML with `---` between them, or JSON, one object a line.

    documents = Documents()
    documents.feed("data: a\n---\nda")  # ["data: a\n"]
    documents.feed('ta: b\n---\n{"data": "c"}\n')  # ["data: b\n", '{"data": "c"}\n']
    documents.end()  # []

That is what `topic echo` prints, without and with `--json`.
"""

from __future__ import annotations

import json
from typing import Final

MAX_DOCUMENT_CHARS: Final = 16 * 1024 * 1024
"""The longest document, in characters: an incomplete one is kept in memory."""


class Documents:
    """Splits a stream into documents. Empty ones are left out."""

    def __init__(self) -> None:
        self._line: list[str] = []
        """Pieces of an incomplete line."""
        self._lines: list[str] = []
        """Lines of an incomplete document."""
        self._size = 0

    def feed(self, text: str) -> list[str]:
        """Return the documents that a piece of text completes.

        Raises:
            ValueError: A document is longer than 16 Mi characters.
        """
        found: list[str] = []
        for line in text.splitlines(keepends=True):
            self._line.append(line)
            self._size += len(line)
            if self._size > MAX_DOCUMENT_CHARS:
                raise ValueError(f"A document is longer than {MAX_DOCUMENT_CHARS} characters")
            if line.endswith("\n"):
                found += self._add_line("".join(self._line))
                self._line.clear()
        return found

    def end(self) -> list[str]:
        """Return the last document, if there is one, at the end of the stream."""
        line = "".join(self._line)
        self._line.clear()
        return [*(self._add_line(line) if line else []), *self._close()]

    def _add_line(self, line: str) -> list[str]:
        """Add a complete line; return the document that it completes."""
        if line.rstrip() in {"---", "..."}:
            return self._close()
        first = not self._lines
        self._lines.append(line)
        return self._close() if first and _is_object(line) else []

    def _close(self) -> list[str]:
        document = "".join(self._lines)
        self._lines.clear()
        self._size = 0
        return [document] if document.strip() else []


def _is_object(line: str) -> bool:
    """Return whether a line is a JSON object."""
    if not line.startswith("{"):
        return False
    try:
        return isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False
