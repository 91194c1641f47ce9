"""What a proxied connection's bytes go through, and in which direction."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Flag
from typing import Any


class Direction(Flag):
    """Which way bytes travel."""

    TO_BROKER = 1
    TO_NODE = 2
    BOTH = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class LinkFaults:
    """The faults of one direction. As it is made, there are none."""

    delay_sec: float = 0.0
    jitter_sec: float = 0.0
    """At most so much is added to the delay, by chance."""
    drip_bytes: int | None = None
    """At most so many bytes at a time ..."""
    drip_every_sec: float = 0.0
    """... and so long between two times."""
    black_hole: bool = False


class Faults(ABC):
    """Faults that can be switched at any time; each stays until it is changed or healed."""

    def delay(self, sec: float, *, jitter_sec: float = 0.0, direction: Direction = Direction.BOTH) -> None:
        """Let every byte arrive `sec` later, and up to `jitter_sec` more by chance; their order stays.

        What is under way is bounded (`pipe.HELD_BYTES`), as a TCP window is: so much per delay goes through.

        Raises:
            ValueError: A time is negative.
        """
        if sec < 0 or jitter_sec < 0:
            raise ValueError(f"A delay cannot be negative, got {sec} and {jitter_sec}")
        self.change(direction, delay_sec=sec, jitter_sec=jitter_sec)

    def drip(self, size_bytes: int, *, every_sec: float, direction: Direction = Direction.BOTH) -> None:
        """Let through at most `size_bytes` every `every_sec` seconds: a slow line, or torn frames.

        Raises:
            ValueError: The size is not positive, or the time negative.
        """
        if size_bytes < 1 or every_sec < 0:
            raise ValueError(f"Cannot drip {size_bytes} bytes every {every_sec} s")
        self.change(direction, drip_bytes=size_bytes, drip_every_sec=every_sec)

    def black_hole(self, *, direction: Direction = Direction.BOTH) -> None:
        """Let nothing through and read nothing, as a cut cable does; nobody is told.

        No byte is lost: TCP sends again what is not acknowledged, so when healed, everything arrives.
        """
        self.change(direction, black_hole=True)

    def heal(self, *, direction: Direction = Direction.BOTH) -> None:
        """End every delay, drip and black hole. What has been closed or reset stays so."""
        fair = LinkFaults()
        self.change(direction, **{name: getattr(fair, name) for name in LinkFaults.__slots__})

    @abstractmethod
    def half_close(self, *, direction: Direction) -> None:
        """End one direction: its receiver reads what is under way and then the end of the stream.

        What the sender sends from now on is thrown away.
        """

    @abstractmethod
    def reset(self) -> None:
        """Cut both sides with a TCP reset within the next loop turns; what is under way is lost.

        A unix socket knows no reset: its side ends without one.
        """

    @abstractmethod
    def change(self, direction: Direction, **changes: Any) -> None:
        """Change fields of the weather of these directions."""
