"""`callboard topic hz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, add_watch_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic hz /chatter": "the rate once a second, as the broker counts: nothing is subscribed to",
    "callboard topic hz /chatter /odom": "a table",
    "callboard topic hz /chatter --subscribe": "with the shortest and the longest gap and the deviation",
    "callboard topic hz /scan --filter 'm.range_max > 1' --once --json": "one measurement, for a script",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics", metavar="TOPIC", nargs="+", help="such as /chatter; several make a table")
    parser.add_argument(
        "--filter",
        metavar="EXPR",
        help="count messages for which this Python expression about m holds (it is evaluated); subscribes",
    )
    parser.add_argument(
        "--wall-time",
        action="store_true",
        help="accepted for ROS 2's sake: the wall clock is always used",
    )
    add_watch_options(parser, window="10000")
    add_json_option(
        parser,
        "one document a second and topic: topic, rate, new, window; "
        "with --subscribe min_sec, max_sec, std_dev_sec",
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    if options.subscribe or options.filter is not None:
        from actors.cli import topic_hz_heard

        return topic_hz_heard.run(options)
    from actors.cli import topic_hz

    return topic_hz.run(options)
