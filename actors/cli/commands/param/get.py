"""`callboard param get`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient

EXAMPLES: Final = {"callboard param get /driver speed": "its value"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument("parameter", metavar="NAME", help="the parameter's name, such as speed")
    parser.add_flag("--hide-type", help="print the value only")
    add_json_option(parser, "one object: name, type, value")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print the value of a parameter."""
    return run_with_client(options, lambda client: _get(options, client))


async def _get(options: Options, client: ParameterClient) -> int:
    from actors.cli.errors import CommandError
    from actors.cli.output import print_json, print_out
    from actors.parameters.types import ParameterType
    from actors.tools import node_documents
    from actors.tools.suggestions import did_you_mean

    (parameter,) = await client.get_parameters([options.parameter])
    kind = parameter.type_
    if kind is ParameterType.NOT_SET:
        known = (await client.list_parameters()).names
        hint = "" if parameter.name in known else did_you_mean(parameter.name, known)
        raise CommandError(f"Parameter not set{hint}")
    document = node_documents.parameter(parameter)
    shown = document["value"]
    if options.json:
        print_json(document)
    elif options.hide_type:
        print_out(str(shown))
    else:
        name = document["type"].removesuffix(" array").capitalize()
        print_out(f"{name} {'values are' if kind >= ParameterType.BYTE_ARRAY else 'value is'}: {shown}")
    return 0
