"""What the KEEP_ALL subscriptions of one publisher allow it, the least of it at hand."""

from __future__ import annotations

from heapq import heapify, heappop, heappush, heapreplace

from proto.limits import MAX_U64


class Least:
    """The least of many numbers that only rise: each change costs the logarithm of how many there are."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self._heap: list[tuple[int, int]] = []
        """Numbers and their keys. One may be out of date, too low or of a key that has gone: it is put right
        when it has come to the top."""

    def add(self, key: int, number: int) -> None:
        """Take another number in."""
        self._numbers[key] = number
        heappush(self._heap, (number, key))
        if len(self._heap) > 2 * len(self._numbers) + 8:
            self._heap = [(each, owner) for owner, each in self._numbers.items()]
            heapify(self._heap)

    def rise(self, key: int, number: int) -> None:
        """A number is this now, if that is more than it was."""
        self._numbers[key] = max(self._numbers[key], number)

    def remove(self, key: int) -> None:
        """Forget a number."""
        del self._numbers[key]

    def get(self) -> int | None:
        """Return the least, or None if there is none."""
        heap, numbers = self._heap, self._numbers
        while heap:
            number, key = heap[0]
            now = numbers.get(key)
            if now == number:
                return number
            if now is None:
                heappop(heap)
            else:
                heapreplace(heap, (now, key))
        return None


class CreditLimits:
    """By subscription: the limits of its credit, in the publisher's numbers.

    A limit that is too large for a frame is the greatest that is not: nobody gets that far.
    """

    def __init__(self) -> None:
        self._sequences = Least()
        self._sizes = Least()
        self._bases: dict[int, int] = {}
        """The publisher's bytes when the subscription was attached."""

    def add(self, subscription: int, sequence_limit: int, byte_limit: int, byte_base: int) -> None:
        """A subscription has been attached; its limits in bytes count from `byte_base`."""
        self._bases[subscription] = byte_base
        self._sequences.add(subscription, min(sequence_limit, MAX_U64))
        self._sizes.add(subscription, min(byte_base + byte_limit, MAX_U64))

    def grant(self, subscription: int, sequence_limit: int, byte_limit: int) -> None:
        """A subscription allows more; one that is not attached is ignored."""
        base = self._bases.get(subscription)
        if base is not None:
            self._sequences.rise(subscription, min(sequence_limit, MAX_U64))
            self._sizes.rise(subscription, min(base + byte_limit, MAX_U64))

    def remove(self, subscription: int) -> bool:
        """Forget a subscription; False if it has no limits."""
        if self._bases.pop(subscription, None) is None:
            return False
        self._sequences.remove(subscription)
        self._sizes.remove(subscription)
        return True

    def least(self) -> tuple[int, int] | None:
        """Return the least limits, sequence and bytes; None if nobody limits."""
        sequence, size = self._sequences.get(), self._sizes.get()
        return None if sequence is None or size is None else (sequence, size)
