"""`callboard param delete`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import report, run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient

EXAMPLES: Final = {"callboard param delete /driver extra": "only parameters of a dynamic type can be deleted"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument("parameter", metavar="NAME", help="the parameter's name, such as speed")
    add_json_option(parser, "one object: name, successful, reason")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Delete a parameter."""
    return run_with_client(options, lambda client: _delete(options, client))


async def _delete(options: Options, client: ParameterClient) -> int:
    from actors.cli.output import print_json

    (result,) = await client.delete_parameters([options.parameter])
    if options.json:
        print_json({"name": options.parameter, "successful": result.successful, "reason": result.reason})
        return int(not result.successful)
    return report(result, "Deleted parameter successfully", "Deleting parameter failed")
