"""How long most of the last things took: percentiles over a sliding window.

    delays = Percentiles()
    delays.add(0.0012)
    print(delays.at(0.99))

A mean hides the few that are late; a percentile is what they are.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

WINDOW: Final = 1000


class Percentiles:
    """The last values, in any unit.

    Args:
        window: How many are kept.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self._values: deque[float] = deque(maxlen=max(1, window))

    def __len__(self) -> int:
        return len(self._values)

    def add(self, value: float) -> None:
        """Take in a value; the oldest leaves when the window is full."""
        self._values.append(value)

    def at(self, part: float) -> float | None:
        """Return the smallest value that is not below this part of all (0.99: p99); None if there is none.

        Raises:
            ValueError: The part is not above 0, or above 1.
        """
        if not 0 < part <= 1:
            raise ValueError(f"A part is above 0 and at most 1, not {part}")
        if not self._values:
            return None
        rank = math.ceil(round(part * len(self._values), 9))  # 0.07 * 100 is a little more than 7
        return sorted(self._values)[rank - 1]
