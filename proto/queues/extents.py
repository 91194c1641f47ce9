"""Free space in a block of memory: first fit, so that the parts at the start are used again and again.

Memory that was written lately is in the processor's caches, and the kernel has provided its pages. The end of
a large block may never need any.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import Final

PAGE_BYTES: Final = 4096
"""Allocations are multiples of this."""


class Extents:
    """The free parts of a block. Free parts that touch are joined, so a large part is found if there is one.

    Args:
        start: The first offset of the block; a multiple of `PAGE_BYTES`.
        end: The offset behind the block; likewise.

    Attributes:
        free_bytes: Free bytes in total. They may lie in parts that are too small for a message.
    """

    __slots__ = ("_sizes", "_starts", "free_bytes")

    def __init__(self, start: int, end: int) -> None:
        # Two lists in the order of the offsets: there are few free parts, and bisecting integers is fast.
        self._starts = [start]
        self._sizes = [end - start]
        self.free_bytes = end - start

    def allocate(self, size: int) -> int | None:
        """Allocate from the first free part that is large enough.

        Args:
            size: Bytes, rounded up to pages.

        Returns:
            The offset of the allocated part; None if no free part is large enough.
        """
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
        """Grow an allocated part in place.

        Args:
            start: Its offset.
            size: Its present size.
            larger: The new size.

        Returns:
            Whether it has grown: the space behind it was free. Otherwise nothing has changed.
        """
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
        """Free an allocated part of this size, and join it with the free parts next to it."""
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
