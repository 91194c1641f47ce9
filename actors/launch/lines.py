"""The lines of one process, each with its label, however they come."""

from __future__ import annotations

from typing import Final

MAX_LINE_BYTES: Final = 65_536
"""A longer line is cut into pieces of this size, each on a line of its own."""

_CONTINUES: Final = 0b1100_0000
_IS_CONTINUATION: Final = 0b1000_0000
_UTF8_LENGTH: Final = 4


class LabelledLines:
    """Cuts what a process writes into lines and labels them. Nothing is kept but the beginning of a line.

    Args:
        label: What stands before each line, in brackets.
    """

    def __init__(self, label: str) -> None:
        self._label = f"[{label}] ".encode()
        self._begun = b""

    def feed(self, data: bytes) -> bytes:
        """Take what has come; return the lines that are whole now."""
        *whole, begun = (self._begun + data).split(b"\n")
        written = [self._line(line) for line in whole]
        while len(begun) > MAX_LINE_BYTES:
            cut = _cut(begun)
            written.append(self._line(begun[:cut]))
            begun = begun[cut:]
        self._begun = begun
        return b"".join(written)

    def end(self) -> bytes:
        """Nothing more will come; return the last line, if it has no end."""
        begun, self._begun = self._begun, b""
        return self._line(begun) if begun else b""

    def _line(self, line: bytes) -> bytes:
        pieces: list[bytes] = []
        while len(line) > MAX_LINE_BYTES:
            cut = _cut(line)
            pieces.append(line[:cut])
            line = line[cut:]
        return b"".join(self._label + piece + b"\n" for piece in (*pieces, line))


def _cut(line: bytes) -> int:
    """Return where to cut a line that is too long: not within a character."""
    for cut in range(MAX_LINE_BYTES, MAX_LINE_BYTES - _UTF8_LENGTH, -1):
        if line[cut] & _CONTINUES != _IS_CONTINUATION:
            return cut
    return MAX_LINE_BYTES  # no UTF-8
