"""`callboard topic delay`: the age of messages on arrival, by the stamp in their header."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.topic.hz import SILENCE, spread, spread_fields
from actors.cli.parsing import (
    Options,
    Parser,
    add_broker_options,
    add_json_option,
    add_ros_options,
    add_watch_options,
)

if TYPE_CHECKING:
    from actors.cli.measuring import DelayMeter

EXAMPLES: Final = {"callboard topic delay /odom": "the age of its messages, by header.stamp and our clock"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /odom; its messages have a header")
    add_watch_options(parser, window="10000", subscribe=False)
    add_json_option(
        parser, "one document a second: topic, new, window, mean_sec, min_sec, max_sec, std_dev_sec"
    )
    add_ros_options(parser, daemon=False, clock="measure in the time of /clock")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print delays until a signal."""
    from actors.cli.measuring import DelayMeter, measure

    return measure(
        options,
        [options.topic],
        lambda topic, snapshot: DelayMeter(topic, options.window, snapshot),
        lambda meters: _print(options, meters[0]),
        announce_from=2,
    )


def _print(options: Options, meter: DelayMeter) -> bool:
    from actors.cli.output import print_err, print_json, print_out

    seen = meter.delay.summary()
    if options.json:
        if seen is not None or not options.once:
            document = {"topic": meter.topic, "new": meter.new, "window": seen.window if seen else 0}
            print_json({**document, "mean_sec": seen and seen.mean_sec, **spread_fields(seen)})
    elif seen is None or not meter.new:
        print_err(SILENCE)
    else:
        print_out(f"average delay: {seen.mean_sec:.3f}\n\t{spread(seen)}")
    return seen is not None
