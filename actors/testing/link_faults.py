"""Faults of a proxied connection: their state per direction, and the methods that switch them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from enum import Flag
from typing import Any


class Direction(Flag):
    """The direction in which bytes travel."""

    TO_BROKER = 1
    TO_NODE = 2
    BOTH = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class LinkFaults:
    """The faults of one direction; by default there are none."""

    delay_sec: float = 0.0
    jitter_sec: float = 0.0
    """Upper limit of a random addition to the delay."""
    drip_bytes: int | None = None
    """At most so many bytes at a time; None: unlimited."""
    drip_every_sec: float = 0.0
    """Time between two such pieces."""
    black_hole: bool = False


class Faults(ABC):
    """Faults that can be switched at any time; each lasts until it is changed or healed."""

    def delay(self, sec: float, *, jitter_sec: float = 0.0, direction: Direction = Direction.BOTH) -> None:
        """Delay every byte; the order is kept.

        At most `pipe.HELD_BYTES` are in transit, as in a TCP window, so throughput is at most this per delay.

        Args:
            sec: The delay in seconds.
            jitter_sec: Upper limit of a random addition to it.
            direction: Which bytes.

        Raises:
            ValueError: A time is negative.
        """
        if sec < 0 or jitter_sec < 0:
            raise ValueError(f"A delay cannot be negative, got {sec} and {jitter_sec}")
        self.change(direction, delay_sec=sec, jitter_sec=jitter_sec)

    def drip(self, size_bytes: int, *, every_sec: float, direction: Direction = Direction.BOTH) -> None:
        """Limit the rate: a slow line, or frames in pieces.

        Args:
            size_bytes: Most bytes to pass on at a time.
            every_sec: Seconds between two such pieces.
            direction: Which bytes.

        Raises:
            ValueError: The size is not positive, or the time negative.
        """
        if size_bytes < 1 or every_sec < 0:
            raise ValueError(f"Cannot drip {size_bytes} bytes every {every_sec} s")
        self.change(direction, drip_bytes=size_bytes, drip_every_sec=every_sec)

    def black_hole(self, *, direction: Direction = Direction.BOTH) -> None:
        """Pass on nothing and read nothing, as a cut cable does; neither side gets an error.

        No byte is lost: TCP retransmits, so everything arrives after `heal`.

        Args:
            direction: Which bytes.
        """
        self.change(direction, black_hole=True)

    def heal(self, *, direction: Direction = Direction.BOTH) -> None:
        """End every delay, drip and black hole. Closed or reset connections stay closed.

        Args:
            direction: Which bytes.
        """
        self.change(direction, **asdict(LinkFaults()))

    @abstractmethod
    def half_close(self, *, direction: Direction) -> None:
        """End one direction: its receiver reads the bytes in transit and then the end of the stream.

        Later bytes of the sender are discarded.

        Args:
            direction: Which one.
        """

    @abstractmethod
    def reset(self) -> None:
        """Cut both sides with a TCP reset within the next loop turns; bytes in transit are lost.

        Unix sockets have no reset: their side is closed.
        """

    @abstractmethod
    def change(self, direction: Direction, **changes: Any) -> None:
        """Change the faults of one or both directions.

        Args:
            direction: Which bytes.
            changes: New values of fields of `LinkFaults`.
        """
