"""Answers and texts that wait for one client. Pure."""

from __future__ import annotations

from collections import deque
from typing import Final, NamedTuple

from actors.web.foxglove import messages as wire

MAX_STATUSES: Final = 100
"""Texts that wait for a client; further ones are counted."""

MAX_STATUS_CHARACTERS: Final = 500
"""The longest text that a client gets; a longer one is cut, as it may quote a client."""

MAX_ANSWERS: Final = 100
"""Answers that wait for a client before nothing more is read from it."""

MAX_ANSWER_BYTES: Final = 1 << 20
"""Bytes of answers that wait for a client before nothing more is read from it."""


class Frame(NamedTuple):
    """What to send.

    Attributes:
        data: A text as UTF-8, or bytes.
        is_text: Which of them.
    """

    data: bytes
    is_text: bool


class Answers:
    """Answers and statuses that wait for the client."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque()
        self._bytes = 0
        self._statuses: dict[str, bytes] = {}
        """By id or text: a thousand equal ones are one."""
        self._omitted = 0

    @property
    def are_many(self) -> bool:
        """Whether so many answers wait that nothing more should be read from the client."""
        return len(self._frames) >= MAX_ANSWERS or self._bytes >= MAX_ANSWER_BYTES

    def add(self, data: bytes, *, is_text: bool = True) -> None:
        """Add an answer.

        Args:
            data: A text as UTF-8, or bytes.
            is_text: Which of them.
        """
        self._frames.append(Frame(data, is_text))
        self._bytes += len(data)

    def report(self, level: int, text: str, status_id: str = "") -> None:
        """Add a text for the user; it replaces one with this id, or the same text.

        Args:
            level: `messages.INFO`, `WARNING` or `ERROR`.
            text: The text; a long one is cut.
            status_id: Of what it is about; "" for nothing that can end.
        """
        text = text if len(text) <= MAX_STATUS_CHARACTERS else f"{text[:MAX_STATUS_CHARACTERS]}…"
        key = status_id or text
        if len(self._statuses) < MAX_STATUSES or key in self._statuses:
            self._statuses[key] = wire.status(level, text, status_id)
        else:
            self._omitted += 1

    def take_back(self, status_id: str) -> None:
        """Let the client forget a text: what it said is no longer so."""
        self._statuses[status_id] = wire.remove_status([status_id])

    def next(self) -> Frame | None:
        """Return what to send next, which no longer waits; None if nothing does."""
        if self._frames:
            frame = self._frames.popleft()
            self._bytes -= len(frame.data)
            return frame
        if self._statuses:
            return Frame(self._statuses.pop(next(iter(self._statuses))), is_text=True)
        if self._omitted:
            text, self._omitted = f"{self._omitted} further messages of this kind are left out", 0
            return Frame(wire.status(wire.WARNING, text), is_text=True)
        return None
