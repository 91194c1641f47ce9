"""`callboard param load`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import report, run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient
    from actors.parameters.types import SetParametersResult

EXAMPLES: Final = {"callboard param load /driver driver.yaml": "set what the file has for the node"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument(
        "file", metavar="FILE", help="a parameter file, as `param dump` prints it, with --json, too"
    )
    parser.add_flag("--no-use-wildcard", help="not what the file has for patterns such as /**")
    add_json_option(parser, "one array of results: name, successful, reason")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Set the parameters that a file has for a node."""
    return run_with_client(options, lambda client: _load(options, client))


async def _load_json(options: Options, client: ParameterClient) -> dict[str, SetParametersResult] | None:
    """Set the parameters of a file as `param dump --json` prints it; return None if it is another one."""
    import asyncio

    from actors.cli.errors import CommandError
    from actors.cli.parameter_json import typed_parameter, values_in_file

    values = await asyncio.to_thread(
        values_in_file, options.file, client.remote_node_name, use_wildcard=not options.no_use_wildcard
    )
    if not values:
        return None
    types = await client.get_parameter_types(list(values))
    try:
        parameters = [
            typed_parameter(name, value, kind)
            for (name, value), kind in zip(values.items(), types, strict=True)
        ]
    except TypeError as error:
        raise CommandError(f"{options.file}: {error}") from None
    return dict(zip(values, await client.set_parameters(parameters), strict=True))


async def _load(options: Options, client: ParameterClient) -> int:
    from actors.cli.output import print_json

    results = await _load_json(options, client)
    if results is None:
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
