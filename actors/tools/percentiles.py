"""Percentiles over a sliding window.

delays = Percentiles()
delays.add(0.0012)
print(delays.at(0.99))

"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

WINDOW: Final = 1000


class Percentiles:
    """The last values, in any unit.

    Args:
        window: The number of values to keep.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self._values: deque[float] = deque(maxlen=max(1, window))

    def __len__(self) -> int:
        return len(self._values)

    def add(self, value: float) -> None:
        """Add a value; a full window drops the oldest.

        Args:
            value: In the unit of the others.
        """
        self._values.append(value)

    def at(self, part: float) -> float | None:
        """Return a percentile; None if there are no values.

        Args:
            part: The part of all values that are not above it: 0.99 for p99.

        Raises:
            ValueError: The part is not in (0, 1].
        """
        if not 0 < part <= 1:
            raise ValueError(f"A part is above 0 and at most 1, not {part}")
        if not self._values:
            return None
        rank = math.ceil(round(part * len(self._values), 9))  # 0.07 * 100 is slightly more than 7
        return sorted(self._values)[rank - 1]
