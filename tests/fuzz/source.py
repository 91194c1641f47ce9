"""Takes decisions from bytes, so that a fuzzer chooses them."""

from __future__ import annotations


class Source:
    """Reads values from bytes; after their end everything is 0.

    Args:
        data: The fuzzer's input.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def ended(self) -> bool:
        """Whether all bytes have been used."""
        return self._at >= len(self._data)

    def below(self, limit: int) -> int:
        """Return a number from 0 to `limit` - 1, of one byte."""
        value = self._data[self._at] if not self.ended else 0
        self._at += 1
        return value % limit

    def take(self, size: int) -> bytes:
        """Return the next bytes."""
        start, self._at = self._at, self._at + size
        return self._data[start : self._at]
