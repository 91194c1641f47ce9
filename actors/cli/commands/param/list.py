"""`callboard param list`."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from actors.cli.parameters import parameter_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_remote_options, time_limit

if TYPE_CHECKING:
    from collections.abc import Awaitable

    from actors.errors import CallFailed
    from actors.node.node import Node
    from actors.parameter_client.client import ParameterClient

EXAMPLES: Final = {
    "callboard param list": "the parameters of all nodes",
    "callboard param list /driver --param-type": "those of one, with their types",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", nargs="?", help="such as /talker; default: all nodes")
    parser.add_argument(
        "--param-prefixes",
        metavar="PREFIX",
        nargs="+",
        default=[],
        help="only these names and those below them",
    )
    parser.add_argument(
        "--filter", metavar="REGEX", default="", help="only names that begin with a match of it"
    )
    parser.add_flag("--param-type", help="print types, too")
    add_json_option(parser, "one array of nodes: node, parameters (name, and with --param-type type)")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print the names of parameters."""
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.loop import run_async
    from actors.cli.remote_node import print_failures

    try:
        pattern = re.compile(options.filter)
    except re.error as error:
        raise CommandError(f"--filter is not a regular expression: {error}", USAGE) from None
    answers = run_async(lambda: _of_one(options) if options.node else _of_all(options))
    found = print_failures(answers)
    chosen = {
        node: {name: types[name] for name in sorted(types) if pattern.match(name)}
        for node, types in found.items()
    }
    _print(options, chosen)
    return int(len(found) < len(answers))


def _print(options: Options, found: dict[str, dict[str, str]]) -> None:
    from actors.cli.output import print_json, print_out

    if options.json:
        print_json(
            [
                {
                    "node": node,
                    "parameters": [
                        {"name": name, "type": kind} if options.param_type else {"name": name}
                        for name, kind in types.items()
                    ],
                }
                for node, types in found.items()
            ]
        )
        return
    for node, types in found.items():
        if types and not options.node:
            print_out(f"{node}:")
        for name, kind in types.items():
            line = f"  {name} (type: {kind})" if options.param_type else f"  {name}"
            print_out(line.replace("\n", "\\n"))  # a name of a parameter may be any text


async def _of_one(options: Options) -> dict[str, dict[str, str] | CallFailed]:
    async with parameter_client(options) as client:
        return {client.remote_node_name: await _types(options, client)}


async def _of_all(options: Options) -> dict[str, dict[str, str] | CallFailed]:
    from actors.cli.remote_node import ask_all
    from actors.parameter_client.client import ParameterClient

    def ask(node: Node, name: str) -> Awaitable[dict[str, str]]:
        return _types(options, ParameterClient(node, name), time_limit(options) / 2)

    return await ask_all(options, "list_parameters", ask)


async def _types(options: Options, client: ParameterClient, limit: float | None = None) -> dict[str, str]:
    """Return the types of a node's parameters by name."""
    names = (await client.list_parameters(options.param_prefixes, timeout_sec=limit)).names
    if not options.param_type:
        return dict.fromkeys(names, "")
    from actors.tools.node_documents import PARAMETER_TYPES

    types = await client.get_parameter_types(names, limit and limit / 2)
    return dict(zip(names, [PARAMETER_TYPES[kind] for kind in types], strict=True))
