"""`callboard action list`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import ACTION, add_hidden_option, add_list_options, list_names
from actors.cli.parsing import Parser, add_broker_options, add_json_option

EXAMPLES: Final = {"callboard action list -t": "all actions, with their types"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_list_options(ACTION, parser)
    add_hidden_option(ACTION, parser)
    add_json_option(parser, "one array of actions: name, types")
    add_broker_options(parser)


run: Final = partial(list_names, ACTION)
