"""`callboard topic bw`, by the broker's counters; `topic_bw_heard` is the same by a subscription."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.output import note, say, say_json
from actors.cli.topic_hz import SILENCE
from actors.tools.rates import BANDWIDTH_WINDOW

if TYPE_CHECKING:
    import argparse

    from actors.cli.counters import Watched


def run(options: argparse.Namespace) -> int:
    """Print bandwidths until a signal."""
    from actors.cli.counters import watch  # noqa: PLC0415 - who subscribes needs it not

    return watch(options, BANDWIDTH_WINDOW, lambda watched: _show(options, watched))


def _show(options: argparse.Namespace, watched: list[Watched]) -> bool:
    known = False
    for each in watched:
        seen = each.counter.traffic()
        if seen is None or not seen.messages:
            if options.json and not options.once:
                say_json({"topic": each.topic, "bytes_per_sec": 0.0, "messages": 0, "mean_bytes": None})
            continue
        known = True
        if options.json:
            say_json(
                {
                    "topic": each.topic,
                    "bytes_per_sec": seen.bytes_per_sec,
                    "messages": seen.messages,
                    "mean_bytes": seen.mean_bytes,
                }
            )
        else:
            where = f"[{each.topic}] " if len(watched) > 1 else ""
            say(f"{where}{shown_bytes(seen.bytes_per_sec)}/s from {seen.messages} messages")
            say(f"\tMessage size mean: {shown_bytes(seen.mean_bytes)}")
    if not known and not options.json:
        note(SILENCE)
    return known


def shown_bytes(size: float) -> str:
    """Return a number of bytes as people read it; a KB is 1000 bytes, as in ROS 2."""
    if size < 1000:
        return f"{size:.0f} B"
    if size < 1_000_000:
        return f"{size / 1000:.2f} KB"
    return f"{size / 1_000_000:.2f} MB"
