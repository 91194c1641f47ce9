"""`callboard topic bw`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, add_watch_options

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard topic bw /image": "bytes a second, by the broker's counters: nothing is subscribed to",
    "callboard topic bw /image --subscribe": "with the smallest and the largest message",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics", metavar="TOPIC", nargs="+", help="such as /chatter")
    add_watch_options(parser, window="100")
    add_json_option(
        parser,
        "one document a second and topic: topic, bytes_per_sec, messages, mean_bytes; "
        "with --subscribe min_bytes, max_bytes",
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    if options.subscribe:
        from actors.cli import topic_bw_heard

        return topic_bw_heard.run(options)
    from actors.cli import topic_bw

    return topic_bw.run(options)
