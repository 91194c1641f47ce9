"""rclpy's points and spans of time: whole nanoseconds in 64 bits, as exact as in a message."""

from __future__ import annotations

import math
from enum import IntEnum
from functools import total_ordering
from typing import TYPE_CHECKING, Final, Protocol, overload

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg import Duration as DurationMsg
    from actors.interfaces.builtin_interfaces.msg import Time as TimeMsg

NANOSECONDS_PER_SECOND: Final = 1_000_000_000
_MAX_NANOSECONDS: Final = (1 << 63) - 1
_MIN_NANOSECONDS: Final = -(1 << 63)


class ClockType(IntEnum):
    """The kind of a clock, with rclpy's numbers. ROS_TIME is the wall clock, or simulated time."""

    UNINITIALIZED = 0
    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3

    @classmethod
    def _missing_(cls, value: object) -> None:
        # As rclpy has it. A number of no clock stays enum's ValueError.
        if not isinstance(value, int):
            raise TypeError(f"a kind of clock is a ClockType, got {value!r}")


class _Stamp(Protocol):
    sec: int
    nanosec: int


def _is_not(kind: type[object], other: object) -> bool:
    # A function, because type checkers take the annotation's word for it, and call a plain `isinstance`
    # needless and what follows unreachable.
    return not isinstance(other, kind)


def _total(seconds: float, nanoseconds: float, kind: str) -> int:
    whole = seconds * NANOSECONDS_PER_SECOND
    if not math.isfinite(whole + nanoseconds):
        raise ValueError(f"{kind} must be finite")
    # An int stays exact; a float is rounded, so that 1.001 s is not a nanosecond short.
    total = round(whole) + round(nanoseconds)
    if not _MIN_NANOSECONDS <= total <= _MAX_NANOSECONDS:
        raise OverflowError(f"{kind} of {total} nanoseconds does not fit into 64 bits")
    return total


@total_ordering
class Duration:
    """A span of time, which may be negative. Immutable.

    Args:
        seconds: Added to `nanoseconds`; a float is rounded to whole nanoseconds.
        nanoseconds: Added to `seconds`; a float is rounded.

    Raises:
        OverflowError: The sum does not fit into 64 bits.
        ValueError: It is not finite.
    """

    __slots__ = ("_nanoseconds",)

    def __init__(self, *, seconds: float = 0, nanoseconds: float = 0) -> None:
        self._nanoseconds = _total(seconds, nanoseconds, "Duration")

    @property
    def nanoseconds(self) -> int:
        """The span in nanoseconds."""
        return self._nanoseconds

    def to_msg(self) -> DurationMsg:
        """Return a builtin_interfaces Duration; its seconds are rounded down."""
        from actors.interfaces.builtin_interfaces.msg import Duration as Message  # noqa: PLC0415 - lazy

        sec, nanosec = divmod(self._nanoseconds, NANOSECONDS_PER_SECOND)
        return Message(sec=sec, nanosec=nanosec)

    @classmethod
    def from_msg(cls, msg: _Stamp) -> Duration:
        """Return the Duration of a message.

        Args:
            msg: A builtin_interfaces Duration, or any object with `sec` and `nanosec`.
        """
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)

    def __add__(self, other: Duration) -> Duration:
        if _is_not(Duration, other):
            return NotImplemented
        return Duration(nanoseconds=self._nanoseconds + other._nanoseconds)

    def __sub__(self, other: Duration) -> Duration:
        if _is_not(Duration, other):
            return NotImplemented
        return Duration(nanoseconds=self._nanoseconds - other._nanoseconds)

    def __mul__(self, factor: float) -> Duration:
        if _is_not(int, factor) and _is_not(float, factor):
            return NotImplemented
        product = self._nanoseconds * factor
        return INFINITE if product == math.inf else Duration(nanoseconds=product)

    __rmul__ = __mul__

    def __neg__(self) -> Duration:
        return Duration(nanoseconds=-self._nanoseconds)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Duration) and self._nanoseconds == other._nanoseconds

    def __lt__(self, other: Duration) -> bool:
        if _is_not(Duration, other):
            return NotImplemented
        return self._nanoseconds < other._nanoseconds

    def __hash__(self) -> int:
        return hash((Duration, self._nanoseconds))

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self._nanoseconds})"

    def __str__(self) -> str:
        return "Infinite" if self == INFINITE else f"{self._nanoseconds} nanoseconds"


INFINITE: Final = Duration(nanoseconds=_MAX_NANOSECONDS)
"""The longest duration, which means no limit."""


@total_ordering
class Time:
    """A point in time of one kind of clock. Immutable.

    Args:
        seconds: Added to `nanoseconds`, not negative; a float is rounded to whole nanoseconds.
        nanoseconds: Added to `seconds`, not negative; a float is rounded.
        clock_type: The kind of clock. Times of different clocks are never equal, and ordering or subtracting
            them raises TypeError.

    Raises:
        OverflowError: The sum does not fit into 64 bits.
        ValueError: It is negative or not finite.
    """

    __slots__ = ("_clock_type", "_nanoseconds")

    def __init__(
        self,
        *,
        seconds: float = 0,
        nanoseconds: float = 0,
        clock_type: ClockType = ClockType.SYSTEM_TIME,
    ) -> None:
        # Also if the sum would be positive: rclpy refuses each of them.
        if seconds < 0:
            raise ValueError("Seconds value must not be negative")
        if nanoseconds < 0:
            raise ValueError("Nanoseconds value must not be negative")
        self._nanoseconds = _total(seconds, nanoseconds, "Time")
        self._clock_type = ClockType(clock_type)

    @property
    def nanoseconds(self) -> int:
        """Nanoseconds since the clock's zero: 1970 for a wall clock."""
        return self._nanoseconds

    @property
    def clock_type(self) -> ClockType:
        """The kind of clock that it was read from."""
        return self._clock_type

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return whole seconds and the remaining nanoseconds."""
        return divmod(self._nanoseconds, NANOSECONDS_PER_SECOND)

    def to_msg(self) -> TimeMsg:
        """Return a builtin_interfaces Time, which has no kind of clock."""
        from actors.interfaces.builtin_interfaces.msg import Time as Message  # noqa: PLC0415 - lazy

        sec, nanosec = self.seconds_nanoseconds()
        return Message(sec=sec, nanosec=nanosec)

    @classmethod
    def from_msg(cls, msg: _Stamp, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """Return the Time of a message.

        Args:
            msg: A builtin_interfaces Time, or any object with `sec` and `nanosec`.
            clock_type: The kind of clock, which the message does not contain.

        Raises:
            ValueError: Its seconds are negative.
        """
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec, clock_type=clock_type)

    def __add__(self, other: Duration) -> Time:
        if _is_not(Duration, other):
            return NotImplemented
        return Time(nanoseconds=self._nanoseconds + other.nanoseconds, clock_type=self._clock_type)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration) -> Time: ...
    def __sub__(self, other: Time | Duration) -> Duration | Time:
        if isinstance(other, Time):
            # A steady clock counts from an arbitrary zero: the difference to a wall clock would be a number
            # without meaning.
            self._require_same_clock(other)
            return Duration(nanoseconds=self._nanoseconds - other._nanoseconds)
        if _is_not(Duration, other):
            return NotImplemented
        return Time(nanoseconds=self._nanoseconds - other.nanoseconds, clock_type=self._clock_type)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Time):
            return NotImplemented
        return self._nanoseconds == other._nanoseconds and self._clock_type is other._clock_type

    def __lt__(self, other: Time) -> bool:
        if _is_not(Time, other):
            return NotImplemented
        self._require_same_clock(other)
        return self._nanoseconds < other._nanoseconds

    def __hash__(self) -> int:
        return hash((Time, self._nanoseconds, self._clock_type))

    def __repr__(self) -> str:
        return f"Time(nanoseconds={self._nanoseconds}, clock_type={self._clock_type.name})"

    def _require_same_clock(self, other: Time) -> None:
        if self._clock_type is not other._clock_type:
            names = f"{self._clock_type.name} and {other._clock_type.name}"
            raise TypeError(f"Can't compare times with different clock types: {names}")
