"""Splits the output of a process into lines."""

from __future__ import annotations

from typing import Final

MAX_LINE_BYTES: Final = 65_536
"""A longer line is cut into pieces of this size, each a line of its own."""

_CONTINUES: Final = 0b1100_0000
_IS_CONTINUATION: Final = 0b1000_0000
_UTF8_LENGTH: Final = 4


class LineSplitter:
    """Splits the output of a process into lines, without their ends. It keeps only the beginning of a line.

    A line ends with a line feed; a carriage return before it, which terminals add, belongs to the end.
    """

    def __init__(self) -> None:
        self._begun = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Add bytes; return the lines that are complete now, and pieces of a line that is too long."""
        # Pieces are returned before their line has ended: a program that never ends one must not fill the
        # memory.
        *whole, begun = (self._begun + data).split(b"\n")
        lines: list[bytes] = []
        for line in whole:
            rest = _pieces(line.removesuffix(b"\r"), lines)
            lines.append(rest)
        # A carriage return may belong to an end whose line feed follows, so it does not count yet.
        text = begun.removesuffix(b"\r")
        self._begun = _pieces(text, lines) + begun[len(text) :]
        return lines

    def end(self) -> list[bytes]:
        """Return the last line if it has no end. Called after the last bytes."""
        begun, self._begun = self._begun, b""
        return [begun] if begun else []


def _pieces(line: bytes, lines: list[bytes]) -> bytes:
    """Append the pieces of a line that is too long to `lines`; return its rest."""
    begin = 0
    while len(line) - begin > MAX_LINE_BYTES:
        end = _cut(line, begin + MAX_LINE_BYTES)
        lines.append(line[begin:end])
        begin = end
    return line[begin:]


def _cut(line: bytes, limit: int) -> int:
    """Return where to cut a line before a limit: not within a character."""
    for cut in range(limit, limit - _UTF8_LENGTH, -1):
        if line[cut] & _CONTINUES != _IS_CONTINUATION:
            return cut
    return limit  # no UTF-8
