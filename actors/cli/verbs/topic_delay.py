"""`callboard topic delay`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, add_watch_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {"callboard topic delay /odom": "the age of its messages, by header.stamp and our clock"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /odom; its messages have a header")
    add_watch_options(parser, window="10000", subscribe=False)
    add_json_option(
        parser, "one document a second: topic, new, window, mean_sec, min_sec, max_sec, std_dev_sec"
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import topic_delay

    return topic_delay.run(options)
