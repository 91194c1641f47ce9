"""The options of a player."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from actors.bags.errors import InvalidBagOptionError
from actors.bags.player.schedule import checked_rate
from actors.bags.storage.bag_file import Order

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from actors.bags.player.played_service import RequestsSource
    from actors.qos.profile import QoSProfile

READ_AHEAD: Final = 1000
"""Default number of messages to read before they are due, as in ROS 2: a second of a fast sensor."""
MAX_READ_AHEAD: Final = 1_000_000
MAX_CLOCK_HZ: Final = 1000.0
"""The event loop wakes up at whole milliseconds, so a faster clock would only cost CPU time."""


@dataclass(frozen=True, kw_only=True)
class PlayerOptions:
    """Options of a player.

    Args:
        rate: Seconds of the bag to play per second; default: 1.
        loop: Start again at the end; False by default.
        start_paused: Publish nothing until `resume` is called.
        start_offset_sec: Start this many seconds after the first message.
        delay_sec: Seconds to wait before each pass through the bag.
        duration_sec: Seconds of the bag to play; 0: nothing, as in ROS 2; None (default) for all.
        until_ns: Play up to this time, in nanoseconds since 1970; None (default) for all. With a duration,
            the later end counts.
        order: Play messages by the times when they were received (Order.LOG, the default) or published
            (Order.PUBLISH).
        read_ahead: Number of messages to read before they are due; default: 1000.
        clock_hz: How many times a second to publish the time of the bag on `/clock`, also while paused; 0
            (default) for never.
        clock_topics: Also publish it before each message of these topics; None for all topics.
        remappings: Names to publish topics under, or to call services by, by recorded name.
        qos_overrides: QoS to publish topics with, by recorded name.
        service_requests: Send recorded requests to their services instead of publishing the service events:
            those that servers received, or those that clients sent; None (default): do not. Each request has
            the node's deadline (`default_call_timeout_sec`, 60 s); playing ends when all are answered or have
            failed.
        wait_for_all_acked_sec: At the end, wait up to this many seconds for all messages to reach the broker;
            0 for no limit, None (default) to not wait.

    Raises:
        InvalidBagOptionError: An option is out of range.
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
    service_requests: RequestsSource | None = None
    wait_for_all_acked_sec: float | None = None

    def __post_init__(self) -> None:
        checked_rate(self.rate)
        for name in ("start_offset_sec", "delay_sec", "clock_hz", "duration_sec", "wait_for_all_acked_sec"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= 1e9:
                unit = "Hz" if name == "clock_hz" else "s"
                raise InvalidBagOptionError(f"{name} must be from 0 to 1e9 {unit}, not {value:g}", name)
        if self.clock_hz > MAX_CLOCK_HZ:
            raise InvalidBagOptionError(
                f"clock_hz must be at most {MAX_CLOCK_HZ:g} Hz, not {self.clock_hz:g}", "clock_hz"
            )
        if not 1 <= self.read_ahead <= MAX_READ_AHEAD:
            raise InvalidBagOptionError(
                f"read_ahead must be from 1 to {MAX_READ_AHEAD:,}, not {self.read_ahead}", "read_ahead"
            )
        if self.order is Order.FILE:
            raise InvalidBagOptionError(
                "order must be Order.LOG or Order.PUBLISH: messages are played by time"
            )

    @property
    def publishes_clock(self) -> bool:
        """Whether the player publishes `/clock` itself; a recorded `/clock` is not played then."""
        return bool(self.clock_hz) or self.clock_topics is None or bool(self.clock_topics)
