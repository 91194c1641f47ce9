"""What a latched publisher keeps of what it has sent, for a broker that restarts: its last messages."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.runs import cut, message_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from proto.frames import Run

RETAINED_BYTES: Final = limits.LANE_BYTES
"""What one publisher keeps, whatever its depth; beyond it the oldest go, but never the last message."""


class Retained:
    """The last messages of one publisher, in runs, oldest first.

    Args:
        keep: How many messages at most.

    Attributes:
        messages: How many there are.
        size: Their bytes.
    """

    __slots__ = ("_keep", "_runs", "messages", "size")

    def __init__(self, keep: int) -> None:
        self.messages = self.size = 0
        self._keep = keep
        self._runs: deque[Run] = deque()

    @property
    def first_sequence(self) -> int | None:
        """The number of the oldest message; None without any."""
        return self._runs[0].first_sequence if self._runs else None

    def newest_first(self, *, before: int | None = None) -> Iterator[Run]:
        """Iterate over the runs, the newest first; only over the messages below a number, if there is one."""
        for run in reversed(self._runs):
            if before is None or run.first_sequence + run.length <= before:
                yield run
            elif run.first_sequence < before:
                yield cut(run, 0, before - run.first_sequence)

    def add(self, run: Run) -> None:
        """A run has been published."""
        self._runs.append(run)
        self.messages += run.length
        self.size += message_bytes(run)
        while self.messages > self._keep or (self.size > RETAINED_BYTES and self.messages > 1):
            oldest = self._runs.popleft()
            gone = min(oldest.length, max(self.messages - self._keep, 1))
            self.messages -= gone
            self.size -= message_bytes(oldest)
            if gone < oldest.length:
                rest = cut(oldest, gone, oldest.length)
                self.size += message_bytes(rest)
                self._runs.appendleft(rest)

    def drop_larger(self, most: int) -> None:
        """Forget the runs with more than `most` bytes of messages."""
        kept = [run for run in self._runs if message_bytes(run) <= most]
        self._runs.clear()
        self.messages = self.size = 0
        for run in kept:
            self.add(run)
