"""`callboard lifecycle set`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options, time_limit

EXAMPLES: Final = {"callboard lifecycle set /driver configure": "the node's on_configure runs"}

TIMEOUT_SEC: Final = 60.0
"""A callback may start hardware."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument(
        "transition", metavar="TRANSITION", help="its label, such as configure, or its number"
    )
    add_json_option(parser, "one object: success")
    add_remote_options(parser, timeout_sec=TIMEOUT_SEC)


def run(options: Options) -> int:
    """Request a transition of a node, and wait for its end."""
    from actors.cli.loop import run_async
    from actors.cli.output import print_err, print_json, print_out

    success = run_async(lambda: _set(options))
    if options.json:
        print_json({"success": success})
    elif success:
        print_out("Transitioning successful")
    else:
        print_err("Transitioning failed")
    return int(not success)


async def _set(options: Options) -> bool:
    from actors.cli.errors import CommandError
    from actors.cli.remote_node import lifecycle_node
    from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetAvailableTransitions

    wanted = options.transition
    async with lifecycle_node(options, "transitions") as (node, name):
        asked = node.create_client(GetAvailableTransitions, f"{name}/get_available_transitions")
        response = await asked.call(GetAvailableTransitions.Request(), time_limit(options))
        available = [each.transition for each in response.available_transitions]
        for transition in available:
            if wanted in {transition.label, str(transition.id)}:
                client = node.create_client(ChangeState, f"{name}/change_state")
                request = ChangeState.Request(transition=transition)
                return (await client.call(request, time_limit(options))).success
    lines = "".join(f"\n- {each.label} [{each.id}]" for each in available)
    raise CommandError(f"Unknown transition requested, available ones are:{lines}")
