"""`callboard param load`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import report, run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient

EXAMPLES: Final = {"callboard param load /driver driver.yaml": "set what the file has for the node"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument("file", metavar="FILE", help="a parameter file, as `param dump` prints it")
    parser.add_flag("--no-use-wildcard", help="not what the file has for patterns such as /**")
    add_json_option(parser, "one array of results: name, successful, reason")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Set the parameters that a file has for a node."""
    return run_with_client(options, lambda client: _load(options, client))


async def _load(options: Options, client: ParameterClient) -> int:
    from actors.cli.output import print_json

    results = await client.load_parameter_file(options.file, use_wildcard=not options.no_use_wildcard)
    if options.json:
        print_json(
            [
                {"name": name, "successful": result.successful, "reason": result.reason}
                for name, result in results.items()
            ]
        )
        return int(not all(result.successful for result in results.values()))
    code = 0
    for name, result in results.items():
        code |= report(result, f"Set parameter {name} successful", f"Set parameter {name} failed")
    return code
