"""`callboard topic bw --subscribe`: by the sizes of the messages that come."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from actors.cli.counters import PRINT_EVERY_SEC
from actors.cli.listening import MEASURING, Listener, warn_unpublished
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.session import graph_of, session
from actors.cli.topic_bw import shown_bytes
from actors.cli.topic_hz import SILENCE
from actors.tools.rates import BANDWIDTH_WINDOW, LEAST_SEC, Bandwidth, BandwidthSummary

if TYPE_CHECKING:
    import argparse

    from actors.endpoints.subscription.backlog import MessageInfo


class Heard:
    """The messages of one topic."""

    def __init__(self, topic: str, window: int | None) -> None:
        self.topic = topic
        self.bandwidth = Bandwidth(window or BANDWIDTH_WINDOW, least_sec=0.0 if window else LEAST_SEC)

    def take(self, data: bytes, info: MessageInfo) -> None:
        """A message has come."""
        self.bandwidth.add(info.received_timestamp / 1e9, len(data))


def run(options: argparse.Namespace) -> int:
    """Print bandwidths until a signal."""
    run_async(lambda: _hear(options))
    return 0


async def _hear(options: argparse.Namespace) -> None:
    async with session(options) as node:
        snapshot = await graph_of(node)
        names = dict.fromkeys(map(node.resolve_topic_name, options.topics))
        topics = [Heard(name, options.window) for name in names]
        with Listener(node, timeout_sec=options.timeout) as listener:
            for each in topics:
                warn_unpublished(snapshot, each.topic)
                listener.hear(each.topic, each.take, MEASURING)
                if not options.json:
                    say(f"Subscribed to [{each.topic}]")
            async for _ in listener.ticks(PRINT_EVERY_SEC):
                if _show(options, topics) and options.once:
                    return


def _show(options: argparse.Namespace, topics: list[Heard]) -> bool:
    known = False
    for each in topics:
        seen = each.bandwidth.summary(time.time_ns() / 1e9)
        known = known or seen is not None
        if options.json:
            if seen is not None or not options.once:
                say_json(_document(each.topic, seen))
        elif seen is not None:
            where = f"[{each.topic}] " if len(topics) > 1 else ""
            say(
                f"{where}{shown_bytes(seen.bytes_per_sec)}/s from {seen.messages} messages\n"
                f"\tMessage size mean: {shown_bytes(seen.mean_bytes)} "
                f"min: {shown_bytes(seen.min_bytes)} max: {shown_bytes(seen.max_bytes)}"
            )
    if not known and not options.json:
        note(SILENCE)
    return known


def _document(topic: str, seen: BandwidthSummary | None) -> dict[str, object]:
    return {
        "topic": topic,
        "bytes_per_sec": seen.bytes_per_sec if seen else 0.0,
        "messages": seen.messages if seen else 0,
        "mean_bytes": seen and seen.mean_bytes,
        "min_bytes": seen and seen.min_bytes,
        "max_bytes": seen and seen.max_bytes,
    }
