"""Splits the output of a process into lines."""

from __future__ import annotations

from typing import Final

MAX_LINE_BYTES: Final = 65_536
"""A longer line is cut into pieces of this size, each a line of its own."""

_CONTINUES: Final = 0b1100_0000
_IS_CONTINUATION: Final = 0b1000_0000
_UTF8_LENGTH: Final = 4


class LineSplitter:
    """Cuts what a process writes into lines, without their ends. Nothing is kept but the beginning of a line.

    An end is a line feed; a carriage return before it, as terminals write it, is part of the end.
    """

    def __init__(self) -> None:
        self._begun = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Take bytes; return the lines that are complete now, and pieces of one that is too long."""
        *whole, begun = (self._begun + data).split(b"\n")
        lines: list[bytes] = []
        for line in whole:
            rest = _pieces(line.removesuffix(b"\r"), lines)
            lines.append(rest)
        # A carriage return may be part of an end that has not come yet: it counts for nothing.
        text = begun.removesuffix(b"\r")
        self._begun = _pieces(text, lines) + begun[len(text) :]
        return lines

    def end(self) -> list[bytes]:
        """Return the last line if it has no end; call it after the last bytes."""
        begun, self._begun = self._begun, b""
        return [begun] if begun else []


def _pieces(line: bytes, lines: list[bytes]) -> bytes:
    """Move the pieces of a line that is too long to the lines; return its rest."""
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
