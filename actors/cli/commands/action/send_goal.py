"""`callboard action send_goal`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import FAILURE, OK, TIMEOUT, USAGE, CommandError
from actors.cli.output import print_err, print_json, print_out
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, positive
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.actions.client import ActionClient
    from actors.actions.client_goal import ClientGoalHandle, GoalResult
    from actors.interfaces.message import Message

CANCEL_SEC: Final = 5.0
"""How long Ctrl-C waits for the answer to its cancellation, and then for the result."""

EXAMPLES: Final = {
    "callboard action send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 5}'": (
        "one goal; its result is printed"
    ),
    "callboard action send_goal --feedback /fibonacci example_interfaces/action/Fibonacci '{order: 5}'": (
        "also what it reports on the way"
    ),
    "callboard action send_goal --stdin /fibonacci example_interfaces/action/Fibonacci": (
        "a goal for each document on stdin, one after the other"
    ),
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("action", metavar="ACTION", help="such as /fibonacci")
    parser.add_argument("type", metavar="TYPE", help="such as example_interfaces/action/Fibonacci")
    parser.add_argument("values", metavar="VALUES", nargs="?", help="a YAML map: '{order: 5}'; default: {}")
    parser.add_flag(
        "--stdin",
        help="send what comes on stdin, one after the other: YAML with --- in between, or a JSON object a "
        "line",
    )
    parser.add_flag("-f", "--feedback", help="also print feedback")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help="wait this long for a server and a goal's end, then cancel the goal and end with 124; "
        "default: no limit",
    )  # fmt: skip
    add_json_option(
        parser,
        "an object for each feedback, with --feedback: feedback; and one for each goal: goal_id, status, "
        "result",
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Send goals, and wait until each has ended. SIGINT cancels the goal."""
    from actors.cli.loop import run_async
    from actors.cli.values import message_from_text, named_action

    action_type: Any = named_action(options.type, options)
    if options.stdin and options.values is not None:
        raise CommandError("Give VALUES or --stdin, not both", USAGE)
    goal = None if options.stdin else message_from_text(action_type.Goal, options.values or "{}")
    return run_async(lambda: _send(options, action_type, goal))


async def _send(options: Options, action_type: Any, goal: Message | None) -> int:
    from contextlib import aclosing
    from functools import partial

    from actors.actions.names import ActionNames
    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.stdin import documents
    from actors.cli.values import message_from_text, require_type
    from actors.interfaces.action import action_types

    code = OK
    async with hidden_node(options) as node:
        # Without a client yet: the broker would warn both sides of one with another type.
        service = ActionNames.of(node.resolve_topic_name(options.action)).send_goal
        require_type(await graph_of(node), EntryKind.SERVICE, service, action_types(action_type).send_goal)
        client: ActionClient[Any, Any, Any] = node.create_action_client(action_type, options.action)
        if goal is not None:
            return await _send_one(options, client, goal)
        async with aclosing(documents(partial(message_from_text, action_type.Goal))) as goals:
            async for each in goals:
                code |= await _send_one(options, client, each)
    return code


async def _send_one(options: Options, client: ActionClient[Any, Any, Any], goal: Message) -> int:
    """Send a goal, wait until it has ended and print its result; return the exit code.

    Raises:
        CommandError: The goal was rejected, or has not ended in time.
    """
    import asyncio

    from actors.actions.states import GoalState
    from actors.interfaces.convert import message_to_ordereddict, message_to_yaml

    try:
        async with asyncio.timeout(options.timeout):
            handle = await _sent(options, client, goal)
            ended = await _ended(options, handle)
    except TimeoutError:
        raise CommandError(f"No result within {options.timeout:g} s", TIMEOUT) from None
    if options.json:
        fields = message_to_ordereddict(ended.result)
        print_json({"goal_id": _hex(handle), "status": ended.status.name, "result": fields})
    else:
        print_out(f"Result:\n    {message_to_yaml(ended.result)}")
        print_out(f"Goal finished with status: {ended.status.name}")
    return OK if ended.status is GoalState.SUCCEEDED else FAILURE


async def _sent(
    options: Options, client: ActionClient[Any, Any, Any], goal: Message
) -> ClientGoalHandle[Any, Any]:
    """Send the goal when there is a server.

    Raises:
        CommandError: The goal was rejected.
    """
    from actors.interfaces.convert import message_to_yaml

    if not options.json:
        print_out("Waiting for an action server to become available...")
    await client.wait_for_server(None)
    if not options.json:
        print_out(f"Sending goal:\n     {message_to_yaml(goal)}")
    handle = await client.send_goal(goal)
    if not handle.accepted:
        raise CommandError("Goal was rejected.")
    if not options.json:
        print_out(f"Goal accepted with ID: {_hex(handle)}\n")
    return handle


async def _ended(options: Options, handle: ClientGoalHandle[Any, Any]) -> GoalResult[Any]:
    """Print feedback until the goal has ended; cancel the goal if this is cancelled."""
    import asyncio

    from actors.interfaces.convert import message_to_ordereddict, message_to_yaml

    try:
        async for feedback in handle:
            if options.feedback and options.json:
                print_json({"feedback": message_to_ordereddict(feedback)})
            elif options.feedback:
                print_out(f"Feedback:\n    {message_to_yaml(feedback)}")
        return await handle.result(None)
    except asyncio.CancelledError:
        await _cancel(handle)
        raise


async def _cancel(handle: ClientGoalHandle[Any, Any]) -> None:
    """Cancel the goal, and wait a moment until it has ended."""
    from proto.errors import CallboardError

    print_err("Canceling goal...")
    try:
        response = await handle.cancel(CANCEL_SEC)
        if not response.goals_canceling:
            print_err("Failed to cancel goal")
            return
        ended = await handle.result(CANCEL_SEC)
    except CallboardError as error:
        print_err(f"Failed to cancel goal: {error}")
        return
    print_err(f"Goal finished with status: {ended.status.name}")


def _hex(handle: ClientGoalHandle[Any, Any]) -> str:
    return bytes(handle.goal_id.uuid).hex()
