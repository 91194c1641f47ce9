"""`callboard lifecycle get`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_remote_options, time_limit

if TYPE_CHECKING:
    from actors.errors import CallFailed
    from actors.interfaces.lifecycle_msgs.msg import State
    from actors.node.node import Node

EXAMPLES: Final = {
    "callboard lifecycle get": "the states of all nodes that have one",
    "callboard lifecycle get /driver": "that of one",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("node", metavar="NODE", nargs="?", help="such as /talker; default: all nodes")
    add_json_option(parser, "one array of nodes: node, label, id")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print the states of nodes."""
    from actors.cli.loop import run_async
    from actors.cli.output import print_json, print_out
    from actors.cli.remote_node import print_failures

    answers = run_async(lambda: _of_one(options) if options.node else _of_all(options))
    found = print_failures(answers)
    if options.json:
        print_json([{"node": name, "label": state.label, "id": state.id} for name, state in found.items()])
    else:
        for name, state in found.items():
            print_out(f"{'' if options.node else f'{name}: '}{state.label} [{state.id}]")
    return int(len(found) < len(answers))


async def _of_one(options: Options) -> dict[str, State | CallFailed]:
    from actors.cli.remote_node import lifecycle_node

    async with lifecycle_node(options, "state") as (node, name):
        return {name: await _state(node, name, time_limit(options))}


async def _of_all(options: Options) -> dict[str, State | CallFailed]:
    from actors.cli.remote_node import ask_all

    return await ask_all(options, "get_state", lambda node, name: _state(node, name, time_limit(options) / 2))


async def _state(node: Node, name: str, limit: float) -> State:
    from actors.interfaces.lifecycle_msgs.srv import GetState

    client = node.create_client(GetState, f"{name}/get_state")
    return (await client.call(GetState.Request(), limit)).current_state
