"""`callboard topic bw`, by the broker's counters or by a subscription."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.commands.topic.hz import SILENCE
from actors.cli.parsing import (
    Options,
    Parser,
    add_broker_options,
    add_json_option,
    add_ros_options,
    add_watch_options,
)

if TYPE_CHECKING:
    from actors.cli.broker_counters import WatchedTopic

EXAMPLES: Final = {
    "callboard topic bw /image": "bytes a second, by the broker's counters: nothing is subscribed to",
    "callboard topic bw /image --subscribe": "with the smallest and the largest message",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics", metavar="TOPIC", nargs="+", help="such as /chatter")
    add_watch_options(parser, window="100")
    add_json_option(
        parser,
        "one document a second and topic: topic, bytes_per_sec, messages, mean_bytes; "
        "with --subscribe min_bytes, max_bytes",
    )
    add_ros_options(parser, daemon=False, clock="measure in the time of /clock; subscribes")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print bandwidths until a signal."""
    from actors.cli.broker_counters import publishes_elsewhere, watch

    options.subscribe = (
        options.subscribe or options.use_sim_time or publishes_elsewhere(options, options.topics)
    )
    if options.subscribe:
        from actors.cli.measuring import BandwidthMeter, measure

        return measure(
            options,
            options.topics,
            lambda topic, _: BandwidthMeter(topic, options.window),
            lambda meters: _print(options, [(each.topic, each.summary()) for each in meters]),
            announce_from=1,
        )
    from actors.tools.rates import BANDWIDTH_WINDOW

    def show(watched: list[WatchedTopic]) -> bool:
        traffic = [(each.topic, each.counter.traffic()) for each in watched]
        return _print(options, [(topic, seen if seen and seen.messages else None) for topic, seen in traffic])

    return watch(options, BANDWIDTH_WINDOW, show)


def _print(options: Options, traffic: list[tuple[str, Any]]) -> bool:
    from actors.cli.output import print_err, print_json, print_out

    known = False
    for topic, seen in traffic:
        known = known or seen is not None
        if options.json:
            if seen is not None or not options.once:
                print_json(_document(topic, seen, received=options.subscribe))
        elif seen is not None:
            where = f"[{topic}] " if len(traffic) > 1 else ""
            sizes = f"mean: {shown_bytes(seen.mean_bytes)}"
            if options.subscribe:
                sizes += f" min: {shown_bytes(seen.min_bytes)} max: {shown_bytes(seen.max_bytes)}"
            print_out(f"{where}{shown_bytes(seen.bytes_per_sec)}/s from {seen.messages} messages")
            print_out(f"\tMessage size {sizes}")
    if not known and not options.json:
        print_err(SILENCE)
    return known


def _document(topic: str, seen: Any, *, received: bool) -> dict[str, object]:
    limits = ("mean_bytes", "min_bytes", "max_bytes") if received else ("mean_bytes",)
    return {
        "topic": topic,
        "bytes_per_sec": seen.bytes_per_sec if seen else 0.0,
        "messages": seen.messages if seen else 0,
        **{name: seen and getattr(seen, name) for name in limits},
    }


def shown_bytes(size: float) -> str:
    """Return a size with its unit; a KB is 1000 bytes, as in ROS 2."""
    if size < 1000:
        return f"{size:.0f} B"
    if size < 1_000_000:
        return f"{size / 1000:.2f} KB"
    return f"{size / 1_000_000:.2f} MB"
