"""`callboard param dump`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient

EXAMPLES: Final = {"callboard param dump /driver": "a file for --params-file and `param load`"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    add_json_option(parser, "the same as one object")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print all parameters of a node as a parameter file."""
    return run_with_client(options, lambda client: _dump(options, client))


async def _dump(options: Options, client: ParameterClient) -> int:
    from actors.cli.output import print_json, print_out
    from actors.cli.parameter_json import with_plain_values
    from actors.parameters.dumping import parameter_file_text, parameter_tree
    from actors.parameters.file_parser import PARAMETERS_KEY

    names = (await client.list_parameters()).names
    found = await client.get_parameters(names)
    if options.json:
        tree = parameter_tree(with_plain_values(found))
        print_json({client.remote_node_name: {PARAMETERS_KEY: tree}})
    else:
        print_out(parameter_file_text(client.remote_node_name, found))
    return 0
