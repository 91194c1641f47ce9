"""`callboard topic hz`, by the broker's counters or by a subscription."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

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
    from actors.cli.measuring import RateMeter
    from actors.graph.snapshot import GraphSnapshot

EXAMPLES: Final = {
    "callboard topic hz /chatter": "the rate once a second, as the broker counts: nothing is subscribed to",
    "callboard topic hz /chatter /odom": "a table",
    "callboard topic hz /chatter --subscribe": "with the shortest and the longest gap and the deviation",
    "callboard topic hz /scan --filter 'm.range_max > 1' --once --json": "one measurement, for a script",
}
COLUMNS: Final = ("topic", "rate", "min_delta", "max_delta", "std_dev", "window")
SILENCE: Final = "no new messages"


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics", metavar="TOPIC", nargs="+", help="such as /chatter; several make a table")
    parser.add_argument(
        "--filter",
        metavar="EXPR",
        help="count messages for which this Python expression about m holds (it is evaluated); subscribes",
    )
    parser.add_flag("--wall-time", help="measure with the wall clock even with --use-sim-time")
    add_watch_options(parser, window="10000")
    add_json_option(
        parser,
        "one document a second and topic: topic, rate, new, window; "
        "with --once, --subscribe or --filter min_sec, max_sec, std_dev_sec",
    )
    add_ros_options(parser, daemon=False, clock="measure in the time of /clock; subscribes")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print rates until a signal."""
    from actors.cli.broker_counters import publishes_elsewhere, watch

    options.use_sim_time = options.use_sim_time and not options.wall_time
    options.subscribe = (
        options.subscribe
        or options.once  # after a second the counters know the rate of a slow topic to a few tenths only
        or options.filter
        or options.use_sim_time
        or publishes_elsewhere(options, options.topics)
    )
    if options.subscribe:
        return _run_subscribed(options)
    from actors.tools.rates import RATE_WINDOW

    return watch(options, RATE_WINDOW, lambda watched: print_counted(options, watched))


def _run_subscribed(options: Options) -> int:
    from actors.cli.measuring import RateMeter, filtered, measure
    from actors.tools.message_filter import MessageFilter

    chosen = None if options.filter is None else MessageFilter(options.filter)

    def meter_of(topic: str, snapshot: GraphSnapshot) -> RateMeter:
        return RateMeter(topic, options.window, filtered(chosen, topic, snapshot))

    return measure(
        options, options.topics, meter_of, lambda meters: print_received(options, meters), announce_from=2
    )


def print_counted(options: Options, watched: list[WatchedTopic]) -> bool:
    """Print the rates by the counters; return whether there was any."""
    rates = [(each.topic, each.new, each.counter.rate() if each.new else None) for each in watched]
    return _print(options, rates, received=False)


def print_received(options: Options, meters: list[RateMeter]) -> bool:
    """Print the rates of received messages; return whether there was any."""
    rates = [(each.topic, each.new, each.rate.summary() if each.new else None) for each in meters]
    return _print(options, rates, received=True)


def _print(options: Options, rates: list[tuple[str, int, Any]], *, received: bool) -> bool:
    from actors.cli.output import print_err, print_json, print_out

    known = [(topic, rate) for topic, _, rate in rates if rate]
    if options.json:
        for topic, new, rate in rates if known or not options.once else []:
            print_json(_document(topic, new, rate, received=received))
    elif not any(new for _, new, _ in rates):
        print_err(SILENCE)
    elif len(rates) > 1:
        if known:
            print_out(_table([_row(topic, rate, received=received) for topic, rate in known]))
    elif known:
        rate = known[0][1]
        print_out(
            f"average rate: {rate.per_sec:.3f}\n\t{spread(rate) if received else f'window: {rate.window}'}"
        )
    return bool(known)


def _document(topic: str, new: int, rate: Any, *, received: bool) -> dict[str, object]:
    return {
        "topic": topic,
        "rate": rate and rate.per_sec,
        "new": new,
        "window": rate.window if rate else 0,
        **(spread_fields(rate) if received else {}),
    }


def spread(summary: Any) -> str:
    """Return ROS 2's second line, of a RateSummary or a DelaySummary."""
    return (
        f"min: {summary.min_sec:.3f}s max: {summary.max_sec:.3f}s "
        f"std dev: {summary.deviation_sec:.5f}s window: {summary.window}"
    )


def spread_fields(summary: Any) -> dict[str, float | None]:
    """Return these values for JSON; `summary` may be None."""
    return {
        "min_sec": summary and summary.min_sec,
        "max_sec": summary and summary.max_sec,
        "std_dev_sec": summary and summary.deviation_sec,
    }


def _row(topic: str, rate: Any, *, received: bool) -> tuple[str, ...]:
    spread = ("-", "-", "-")  # counters do not say when each message came
    if received:
        spread = (f"{rate.min_sec:.3f}", f"{rate.max_sec:.3f}", f"{rate.deviation_sec:.5f}")
    return (topic, f"{rate.per_sec:.3f}", *spread, str(rate.window))


def _table(rows: list[tuple[str, ...]]) -> str:
    """Return ROS 2's table: a header, a rule, a row for each topic."""
    widths = [max(map(len, column)) for column in zip(COLUMNS, *rows, strict=True)]
    widths[1:] = [max(9, width) for width in widths[1:]]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in (COLUMNS, *rows)
    ]
    return "\n".join([lines[0], "=" * len(lines[0]), *lines[1:], ""])
