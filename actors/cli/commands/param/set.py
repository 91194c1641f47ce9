"""`callboard param set`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import report, run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient
    from actors.parameters.types import Parameter

EXAMPLES: Final = {
    "callboard param set /driver speed 2.5": "one value",
    "callboard param set --atomic /driver speed 2.5 frame map": "several, all or none",
    "callboard param set /driver offset -- -1.5e-3": "a negative value that is not a plain number",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument(
        "pairs", metavar="NAME VALUE", nargs="+",
        help="a parameter and its value, as YAML: 1 is an integer, 1.0 a double, [a, b] a string array",
    )  # fmt: skip
    parser.add_flag("--atomic", help="set all of them, or none")
    add_json_option(parser, "one array of results, or with --atomic one object: name, successful, reason")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Set parameters."""
    from actors.cli.errors import USAGE, CommandError
    from actors.parameters.types import Parameter, parameter_value_from_string

    words = options.pairs
    if len(words) % 2:
        raise CommandError(
            f"No value for the parameter '{words[-1]}'; write NAME VALUE [NAME VALUE …]", USAGE
        )
    wanted = [
        Parameter(name, value=parameter_value_from_string(text))
        for name, text in zip(words[::2], words[1::2], strict=True)
    ]
    return run_with_client(options, lambda client: _set(options, client, wanted))


async def _set(options: Options, client: ParameterClient, wanted: list[Parameter]) -> int:
    from actors.cli.output import print_json

    if options.atomic:
        result = await client.set_parameters_atomically(wanted)
        if options.json:
            print_json({"successful": result.successful, "reason": result.reason})
            return int(not result.successful)
        return report(result, "Set parameters atomically successful", "Setting parameters atomically failed")
    results = await client.set_parameters(wanted)
    if options.json:
        print_json(
            [
                {"name": parameter.name, "successful": result.successful, "reason": result.reason}
                for parameter, result in zip(wanted, results, strict=True)
            ]
        )
        return int(not all(result.successful for result in results))
    code = 0
    for parameter, result in zip(wanted, results, strict=True):
        which = f"{parameter.name}: " if len(wanted) > 1 else ""
        code |= report(result, f"{which}Set parameter successful", f"{which}Setting parameter failed")
    return code
