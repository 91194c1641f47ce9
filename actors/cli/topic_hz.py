"""`callboard topic hz`, by the broker's counters; `topic_hz_heard` is the same by subscriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.output import note, say, say_json
from actors.tools.rates import RATE_WINDOW

if TYPE_CHECKING:
    import argparse

    from actors.cli.counters import Watched

COLUMNS: Final = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")
UNMEASURED: Final = ("-", "-", "-")
"""Counters do not say when each message came."""
SILENCE: Final = "no new messages"


def run(options: argparse.Namespace) -> int:
    """Print rates until a signal."""
    from actors.cli.counters import watch  # noqa: PLC0415 - who subscribes needs it not

    return watch(options, RATE_WINDOW, lambda watched: _show(options, watched))


def _show(options: argparse.Namespace, watched: list[Watched]) -> bool:
    rates = [(each, each.counter.rate() if each.new else None) for each in watched]
    known = any(rate for _, rate in rates)
    if options.json:
        for each, rate in rates if known or not options.once else []:
            say_json(
                {
                    "topic": each.topic,
                    "rate": rate and rate.per_sec,
                    "new": each.new,
                    "window": rate.window if rate else 0,
                }
            )
    elif not any(each.new for each in watched):
        note(SILENCE)
    elif len(watched) > 1:
        rows: list[tuple[str, ...]] = [
            (each.topic, f"{rate.per_sec:.3f}", *UNMEASURED, str(rate.window)) for each, rate in rates if rate
        ]
        if rows:
            say(table(rows))
    elif rates[0][1]:
        rate = rates[0][1]
        say(f"average rate: {rate.per_sec:.3f}\n\twindow: {rate.window}")
    return known


def table(rows: list[tuple[str, ...]]) -> str:
    """Return ROS 2's table: a header, a rule, a row for each topic."""
    widths = [max(map(len, column)) for column in zip(COLUMNS, *rows, strict=True)]
    widths[1:] = [max(9, width) for width in widths[1:]]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in (COLUMNS, *rows)
    ]
    return "\n".join([lines[0], "=" * len(lines[0]), *lines[1:], ""])
