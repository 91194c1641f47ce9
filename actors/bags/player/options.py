"""The options of a player."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from actors.bags.files import Order
from actors.bags.player.errors import InvalidPlayingError
from actors.bags.player.schedule import checked_rate

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from actors.qos.profile import QoSProfile

READ_AHEAD: Final = 1000
"""Messages that are read before they are due: a second of a fast sensor, and ROS 2's default."""
MAX_READ_AHEAD: Final = 1_000_000
MAX_CLOCK_HZ: Final = 1000.0
"""A clock that is published more often than the event loop can wait would only cost CPU time."""


@dataclass(frozen=True, kw_only=True)
class PlayerOptions:
    """How a player plays.

    Args:
        rate: Seconds of the bag for each second; 1 by default.
        loop: Begin again at the end; False by default.
        start_paused: Publish nothing before `resume`.
        start_offset_sec: Begin so long after the first message.
        delay_sec: Wait so long before each pass through the bag.
        duration_sec: Play this much of the bag; None (default) for all.
        until_ns: Play up to this time of the bag, in nanoseconds since 1970; None (default) for all. With a
            duration, the later one counts.
        order: Whether the times when messages were received (Order.LOG, the default) or those when they were
            published (Order.PUBLISH) say when they are played.
        read_ahead: Messages that are read before they are due, 1000 by default.
        clock_hz: Publish the time of the bag on `/clock`, so many times a second, also while paused; 0
            (default): do not.
        clock_topics: Publish it before each message of these topics, too; None for all topics.
        remappings: By recorded name of a topic, the name to publish on.
        qos_overrides: By recorded name of a topic, the QoS to publish with.
        wait_for_all_acked_sec: At the end, wait at most so long until everything has reached the broker; 0
            for no limit, None (default): do not wait.

    Raises:
        InvalidPlayingError: An option is out of range.
    """

    rate: float = 1.0
    loop: bool = False
    start_paused: bool = False
    start_offset_sec: float = 0
    delay_sec: float = 0
    duration_sec: float | None = None
    until_ns: int | None = None
    order: Order = Order.LOG
    read_ahead: int = READ_AHEAD
    clock_hz: float = 0
    clock_topics: Collection[str] | None = ()
    remappings: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    qos_overrides: Mapping[str, QoSProfile] = field(default_factory=lambda: MappingProxyType({}))
    wait_for_all_acked_sec: float | None = None

    def __post_init__(self) -> None:
        checked_rate(self.rate)
        for name in ("start_offset_sec", "delay_sec", "clock_hz", "duration_sec", "wait_for_all_acked_sec"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= 1e9:
                raise InvalidPlayingError(f"{name} is from 0 to 1e9, not {value:g}")
        if self.clock_hz > MAX_CLOCK_HZ:
            raise InvalidPlayingError(f"clock_hz is at most {MAX_CLOCK_HZ:g}, not {self.clock_hz:g}")
        if not 1 <= self.read_ahead <= MAX_READ_AHEAD:
            raise InvalidPlayingError(f"read_ahead is from 1 to {MAX_READ_AHEAD:,}, not {self.read_ahead}")
        if self.order is Order.FILE:
            raise InvalidPlayingError("Messages are played by time: order is Order.LOG or Order.PUBLISH")

    @property
    def publishes_clock(self) -> bool:
        """Whether the player is a source of `/clock`; a recorded one is not played then."""
        return bool(self.clock_hz) or self.clock_topics is None or bool(self.clock_topics)
