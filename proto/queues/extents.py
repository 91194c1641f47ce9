"""Free space in a block of memory: first fit, so that the parts used last are used again first.

Memory that has been written lately is in caches and has pages; the end of a large block may never get any.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import Final

PAGE_BYTES: Final = 4096
"""Allocations are multiples of this."""


class Extents:
    """The free parts of a block, none next to another.

    Args:
        start: Where the block begins; a multiple of `PAGE_BYTES`.
        end: Where it ends; likewise.

    Attributes:
        free_bytes: What is free in all.
    """

    __slots__ = ("_sizes", "_starts", "free_bytes")

    def __init__(self, start: int, end: int) -> None:
        self._starts = [start]
        self._sizes = [end - start]
        self.free_bytes = end - start

    def allocate(self, size: int) -> int | None:
        """Take the first free part of this size, rounded up to pages; return where it begins, or None."""
        size = rounded(size)
        for index, free in enumerate(self._sizes):
            if free >= size:
                start = self._starts[index]
                if free == size:
                    del self._starts[index], self._sizes[index]
                else:
                    self._starts[index] += size
                    self._sizes[index] -= size
                self.free_bytes -= size
                return start
        return None

    def extend(self, start: int, size: int, larger: int) -> bool:
        """Let an allocated part have a larger size; return whether what follows it is free."""
        size, larger = rounded(size), rounded(larger)
        if larger == size:
            return True
        starts, sizes = self._starts, self._sizes
        index = bisect_left(starts, start)
        more = larger - size
        if index == len(starts) or starts[index] != start + size or sizes[index] < more:
            return False
        if sizes[index] == more:
            del starts[index], sizes[index]
        else:
            starts[index] += more
            sizes[index] -= more
        self.free_bytes -= more
        return True

    def free(self, start: int, size: int) -> None:
        """Return an allocated part, and join it with the free parts next to it."""
        size = rounded(size)
        starts, sizes = self._starts, self._sizes
        self.free_bytes += size
        index = bisect_left(starts, start)
        if index < len(starts) and start + size == starts[index]:
            size += sizes[index]
            del starts[index], sizes[index]
        if index and starts[index - 1] + sizes[index - 1] == start:
            sizes[index - 1] += size
        else:
            starts.insert(index, start)
            sizes.insert(index, size)


def rounded(size: int) -> int:
    """Return a size as a multiple of `PAGE_BYTES`."""
    return -(-size // PAGE_BYTES) * PAGE_BYTES
