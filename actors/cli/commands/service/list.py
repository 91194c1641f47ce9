"""`callboard service list`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import SERVICE, add_hidden_option, add_list_options, list_names
from actors.cli.parsing import Parser, add_broker_options, add_json_option, add_ros_options

EXAMPLES: Final = {"callboard service list -t": "all services, with their types"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_list_options(SERVICE, parser)
    add_hidden_option(SERVICE, parser)
    add_json_option(parser, "one array of services: name, types")
    add_ros_options(parser)
    add_broker_options(parser)


run: Final = partial(list_names, SERVICE)
