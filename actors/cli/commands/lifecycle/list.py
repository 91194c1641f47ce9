"""`callboard lifecycle list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options, time_limit

if TYPE_CHECKING:
    from actors.interfaces.lifecycle_msgs.msg import TransitionDescription

EXAMPLES: Final = {
    "callboard lifecycle list /driver": "the transitions that are possible now",
    "callboard lifecycle list -a /driver": "all that there are",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_flag("-a", "--all", help="all transitions, not only those from the current state")
    add_json_option(parser, "one array of transitions: id, label, start_state, goal_state")
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print the transitions of a node."""
    from actors.cli.loop import run_async
    from actors.cli.output import print_json, print_out
    from actors.tools import node_documents

    found = run_async(lambda: _transitions(options))
    if options.json:
        print_json([node_documents.transition(each) for each in found])
        return 0
    for each in found:
        print_out(f"- {each.transition.label} [{each.transition.id}]")
        print_out(f"\tStart: {each.start_state.label}")
        print_out(f"\tGoal: {each.goal_state.label}")
    return 0


async def _transitions(options: Options) -> list[TransitionDescription]:
    from actors.cli.remote_node import lifecycle_node
    from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions

    async with lifecycle_node(options, "transitions") as (node, name):
        service = "get_transition_graph" if options.all else "get_available_transitions"
        client = node.create_client(GetAvailableTransitions, f"{name}/{service}")
        response = await client.call(GetAvailableTransitions.Request(), time_limit(options))
        return response.available_transitions
