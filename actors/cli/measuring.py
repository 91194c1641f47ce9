"""Measure received messages: `topic delay`, and `topic hz` and `bw` with `--subscribe`."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final, TypeVar

from actors.cli.broker_counters import PRINT_EVERY_SEC
from actors.cli.errors import CommandError
from actors.cli.hidden_node import graph_of, hidden_node
from actors.cli.loop import run_async
from actors.cli.output import print_out
from actors.cli.parsing import import_from_working_directory
from actors.cli.subscriber import Listener, warn_unpublished
from actors.interfaces.errors import InvalidMessageError
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from actors.tools.generic_subscription import decoder_of
from actors.tools.message_filter import InvalidFilterError
from actors.tools.rates import (
    BANDWIDTH_WINDOW,
    LEAST_SEC,
    RATE_WINDOW,
    Bandwidth,
    BandwidthSummary,
    Delay,
    Rate,
)
from actors.tools.stamps import stamp_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.cli.parsing import Options
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot
    from actors.time.clock import Clock
    from actors.tools.message_filter import MessageFilter

MEASURING: Final = QoSProfile(depth=10_000, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Best effort, so that it matches every publisher; deep, so that it keeps a burst."""


class Meter:
    """Measures the messages of one topic.

    Attributes:
        topic: Its full name.
        new: Messages since the last output.
        clock: The clock of simulated time; None for the wall clock.
    """

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.new = 0
        self.clock: Clock | None = None

    def receive(self, data: bytes, info: MessageInfo) -> None:
        """Count a message, unless it arrives before the first time of simulated time."""
        if self.clock is None:
            self.add(data, info)
        elif now_ns := self.clock.now().nanoseconds:
            self.add(data, info._replace(received_timestamp=now_ns))

    def add(self, data: bytes, info: MessageInfo) -> None:
        """Count a message."""
        raise NotImplementedError


MeterT = TypeVar("MeterT", bound=Meter)


def measure(
    options: Options,
    topics: list[str],
    meter_of: Callable[[str, GraphSnapshot], MeterT],
    show: Callable[[list[MeterT]], bool],
    *,
    announce_from: int,
) -> int:
    """Measure until a signal, and call `show` once a second; return the exit code.

    Args:
        options: `once` and `timeout`, `json`, `use_sim_time`, and where the broker is.
        topics: As the command line names them.
        meter_of: Makes the meter of a topic.
        show: Prints the meters, and returns whether there was anything to print.
        announce_from: The number of topics from which each is announced; never with `--json`.

    Raises:
        CommandError: No message arrived within `--timeout`.
    """

    async def receive() -> None:
        async with hidden_node(options) as node:
            names = list(dict.fromkeys(map(node.resolve_topic_name, topics)))
            snapshot = await graph_of(node)
            if options.use_sim_time:  # without a time nothing counts
                warn_unpublished(snapshot, "/clock")
            meters: list[MeterT] = []
            with Listener(node, timeout_sec=options.timeout) as listener:
                for name in names:
                    warn_unpublished(snapshot, name)
                    meter = meter_of(name, snapshot)
                    meter.clock = node.get_clock() if options.use_sim_time else None
                    listener.subscribe(name, meter.receive, MEASURING)
                    meters.append(meter)
                    if len(names) >= announce_from and not options.json:
                        print_out(f"Subscribed to [{name}]")
                async for _ in listener.ticks(PRINT_EVERY_SEC):
                    known = show(meters)
                    for meter in meters:
                        meter.new = 0
                    if known and options.once:
                        return

    import_from_working_directory()
    run_async(receive)
    return 0


class RateMeter(Meter):
    """The rate of messages.

    Args:
        topic: Its full name.
        window: Messages in the window; None for ROS 2's number, and a second at least.
        counts: Returns whether a message counts.
    """

    def __init__(self, topic: str, window: int | None, counts: Callable[[bytes], bool]) -> None:
        super().__init__(topic)
        self.rate = Rate(window or RATE_WINDOW, least_sec=0.0 if window else LEAST_SEC)
        self._counts = counts

    def add(self, data: bytes, info: MessageInfo) -> None:
        """Count a message.

        Raises:
            InvalidFilterError: The filter has failed for every message so far.
            InvalidMessageError: The bytes are not a message, or the filter failed for this message only.
        """
        if self._counts(data):
            self.rate.add(info.received_timestamp / 1e9)
            self.new += 1


def filtered(chosen: MessageFilter | None, topic: str, snapshot: GraphSnapshot) -> Callable[[bytes], bool]:
    """Return a function that returns whether a message of a topic counts."""
    if chosen is None:
        return lambda _: True
    decode, matched = decoder_of(snapshot, topic), False

    def counts(data: bytes) -> bool:
        nonlocal matched
        try:
            passes = chosen.passes(decode(data))
        except InvalidFilterError as error:
            if matched:  # the message is wrong, not the filter
                raise InvalidMessageError(str(error)) from None
            raise
        matched = True
        return passes

    return counts


class BandwidthMeter(Meter):
    """The bandwidth of messages."""

    def __init__(self, topic: str, window: int | None) -> None:
        super().__init__(topic)
        self._bandwidth = Bandwidth(window or BANDWIDTH_WINDOW, least_sec=0.0 if window else LEAST_SEC)

    def add(self, data: bytes, info: MessageInfo) -> None:
        """Count a message."""
        self._bandwidth.add(info.received_timestamp / 1e9, len(data))

    def summary(self) -> BandwidthSummary | None:
        """Return the bandwidth until now; None before the first message."""
        now_ns = time.time_ns() if self.clock is None else self.clock.now().nanoseconds
        return self._bandwidth.summary(now_ns / 1e9)


class DelayMeter(Meter):
    """The age of messages on arrival, by the stamp in their header."""

    def __init__(self, topic: str, window: int | None, snapshot: GraphSnapshot) -> None:
        super().__init__(topic)
        self.delay = Delay(window or RATE_WINDOW)
        self._decode = decoder_of(snapshot, topic)

    def add(self, data: bytes, info: MessageInfo) -> None:
        """Count a message.

        Raises:
            CommandError: No message so far has a header.
            InvalidMessageError: The bytes are not a message, or this message only has no header.
        """
        sent_ns = stamp_of(self._decode(data))
        if sent_ns is None:
            if self.delay.summary() is not None:
                raise InvalidMessageError("it has no header")
            text = "msg does not have header: the delay is read from header.stamp, which messages of"
            raise CommandError(f"{text} {self.topic} do not have")
        self.delay.add((info.received_timestamp - sent_ns) / 1e9)
        self.new += 1
