"""`callboard topic hz --subscribe`: by the times at which messages come."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.cli.counters import PRINT_EVERY_SEC
from actors.cli.here import look_here
from actors.cli.listening import MEASURING, Listener, warn_unpublished
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.session import graph_of, session
from actors.cli.topic_hz import SILENCE, table
from actors.interfaces.errors import InvalidMessageError
from actors.tools.hearing import decoder_of
from actors.tools.message_filter import InvalidFilterError, MessageFilter
from actors.tools.rates import LEAST_SEC, RATE_WINDOW, Rate, RateSummary

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo


class Heard:
    """The messages of one topic.

    Args:
        topic: Its full name.
        window: The messages to look back on; None for ROS 2's number, and a second at least.
        wanted: Tells which of its messages count.
    """

    def __init__(self, topic: str, window: int | None, wanted: Callable[[bytes], bool]) -> None:
        self.topic = topic
        self.rate = Rate(window or RATE_WINDOW, least_sec=0.0 if window else LEAST_SEC)
        self.new = 0
        self._wanted = wanted

    def take(self, data: bytes, info: MessageInfo) -> None:
        """A message has come.

        Raises:
            InvalidFilterError: The filter does not fit it, and has fitted none before.
            InvalidMessageError: It is no message, or the filter does not fit it alone.
        """
        if self._wanted(data):
            self.rate.add(info.received_timestamp / 1e9)
            self.new += 1


def run(options: argparse.Namespace) -> int:
    """Print rates until a signal."""
    chosen = None if options.filter is None else MessageFilter(options.filter)
    look_here()
    run_async(lambda: _hear(options, chosen))
    return 0


async def _hear(options: argparse.Namespace, chosen: MessageFilter | None) -> None:
    async with session(options) as node:
        names = list(dict.fromkeys(map(node.resolve_topic_name, options.topics)))
        snapshot = await graph_of(node)
        topics: list[Heard] = []
        with Listener(node, timeout_sec=options.timeout) as listener:
            for name in names:
                warn_unpublished(snapshot, name)
                heard = Heard(name, options.window, _wanted(chosen, decoder_of(snapshot, name)))
                listener.hear(name, heard.take, MEASURING)
                topics.append(heard)
                if len(names) > 1 and not options.json:
                    say(f"Subscribed to [{name}]")
            async for _ in listener.ticks(PRINT_EVERY_SEC):
                if show(options, topics) and options.once:
                    return


def _wanted(chosen: MessageFilter | None, decode: Callable[[bytes], Any]) -> Callable[[bytes], bool]:
    if chosen is None:
        return lambda _: True
    fitted = False

    def wanted(data: bytes) -> bool:
        nonlocal fitted
        try:
            passes = chosen.passes(decode(data))
        except InvalidFilterError as error:
            if fitted:  # it is this message's fault, and not the filter's
                raise InvalidMessageError(str(error)) from None
            raise
        fitted = True
        return passes

    return wanted


def show(options: argparse.Namespace, topics: list[Heard]) -> bool:
    """Print what is known, if anything; return whether it is."""
    rates = [(each, each.rate.summary() if each.new else None) for each in topics]
    known = any(rate for _, rate in rates)
    if options.json:
        for each, rate in rates if known or not options.once else []:
            say_json(_document(each, rate))
    elif not any(each.new for each in topics):
        note(SILENCE)
    elif len(topics) > 1:
        rows = [(each.topic, *_row(rate)) for each, rate in rates if rate]
        if rows:
            say(table(rows))
    elif rates[0][1]:
        rate = rates[0][1]
        say(f"average rate: {rate.per_sec:.3f}\n\t{spread(rate)}")
    for each in topics:
        each.new = 0
    return known


def spread(rate: Any) -> str:
    """Return ROS 2's second line, of a RateSummary or a DelaySummary."""
    return (
        f"min: {rate.min_sec:.3f}s max: {rate.max_sec:.3f}s "
        f"std dev: {rate.deviation_sec:.5f}s window: {rate.window}"
    )


def _row(rate: RateSummary) -> tuple[str, ...]:
    return (
        f"{rate.per_sec:.3f}",
        f"{rate.min_sec:.3f}",
        f"{rate.max_sec:.3f}",
        f"{rate.deviation_sec:.5f}",
        str(rate.window),
    )


def _document(heard: Heard, rate: RateSummary | None) -> dict[str, object]:
    return {
        "topic": heard.topic,
        "rate": rate and rate.per_sec,
        "new": heard.new,
        "window": rate.window if rate else 0,
        "min_sec": rate and rate.min_sec,
        "max_sec": rate and rate.max_sec,
        "std_dev_sec": rate and rate.deviation_sec,
    }
