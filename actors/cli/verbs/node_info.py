"""`callboard node info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard node info /talker": "what it publishes, subscribes to, serves and calls",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", help="such as /talker")
    parser.add_argument(
        "--include-hidden", action="store_true", help="also topics, services and actions with a leading _"
    )
    add_json_option(
        parser,
        "one object: name, subscribers, publishers, service_servers, service_clients and so on",
    )
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import node_info

    return node_info.run(options)
