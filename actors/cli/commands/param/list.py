"""`callboard param list`."""

from __future__ import annotations

import asyncio
import re
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.cli.parameters import TYPE_NAMES, add_parameter_options, parameter_client, visible_nodes
from actors.cli.parsing import Options, Parser, add_json_option

if TYPE_CHECKING:
    from actors.node.node import Node

EXAMPLES: Final = {
    "callboard param list": "the parameters of all nodes",
    "callboard param list /driver --param-type": "those of one, with their types",
}


class Found(NamedTuple):
    """The parameters of a node: types by name; or why there are none."""

    types: dict[str, str]
    error: str = ""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", nargs="?", help="such as /talker; default: all nodes")
    parser.add_argument(
        "--param-prefixes", metavar="PREFIX", nargs="+", default=[], help="only names below one of these"
    )
    parser.add_argument(
        "--filter", metavar="REGEX", default="", help="only names that this expression matches"
    )
    parser.add_flag("--param-type", help="print types, too")
    add_json_option(parser, "one array of nodes: node, parameters (name, and with --param-type type)")
    add_parameter_options(parser)


def run(options: Options) -> int:
    """Print the names of parameters."""
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.loop import run_async
    from actors.cli.output import print_err

    try:
        pattern = re.compile(options.filter)
    except re.error as error:
        raise CommandError(f"--filter is not a regular expression: {error}", USAGE) from None
    found = run_async(lambda: _of_one(options) if options.node else _of_all(options))
    chosen = {
        node: {name: each.types[name] for name in sorted(each.types) if pattern.search(name)}
        for node, each in sorted(found.items())
        if not each.error
    }
    _print(options, chosen)
    failed = {node: each.error for node, each in sorted(found.items()) if each.error}
    for node, reason in failed.items():
        print_err(f"Exception while calling service of node '{node}': {reason}")
    return int(bool(failed))


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
        if not options.node:
            print_out(f"{node}:")
        for name, kind in types.items():
            line = f"  {name} (type: {kind})" if options.param_type else f"  {name}"
            print_out(line.replace("\n", "\\n"))  # a name of a parameter may be any text


async def _of_one(options: Options) -> dict[str, Found]:
    async with parameter_client(options) as client:
        names = (await client.list_parameters(options.param_prefixes)).names
        types = await client.get_parameter_types(names) if options.param_type else [0] * len(names)
        kinds = [TYPE_NAMES[kind] for kind in types]
        return {client.remote_node_name: Found(dict(zip(names, kinds, strict=True)))}


async def _of_all(options: Options) -> dict[str, Found]:
    from actors.cli.errors import TIMEOUT, CommandError
    from actors.cli.hidden_node import graph_of, hidden_node
    from proto.codes import EntryKind

    try:
        async with asyncio.timeout(options.timeout), hidden_node(options) as node:
            snapshot = await graph_of(node)
            served = {name for name, _ in snapshot.names_and_types(EntryKind.SERVICE)}
            wanted = [
                name
                for name in visible_nodes(snapshot, hidden=options.include_hidden_nodes)
                if f"{name}/list_parameters" in served
            ]
            found = await asyncio.gather(*(_of_each(options, node, name) for name in wanted))
    except TimeoutError:
        raise CommandError(f"The graph was not received within {options.timeout:g} s", TIMEOUT) from None
    return dict(zip(wanted, found, strict=True))


async def _of_each(options: Options, node: Node, name: str) -> Found:
    """Ask one of all nodes; one that does not answer does not keep the others from being printed."""
    from actors.errors import CallFailed
    from actors.parameter_client.client import ParameterClient

    client = ParameterClient(node, name)
    limit = options.timeout / 2
    try:
        names = (await client.list_parameters(options.param_prefixes, timeout_sec=limit)).names
        types = await client.get_parameter_types(names, limit / 2) if options.param_type else [0] * len(names)
    except CallFailed as error:
        return Found({}, str(error))
    return Found(dict(zip(names, [TYPE_NAMES[kind] for kind in types], strict=True)))
