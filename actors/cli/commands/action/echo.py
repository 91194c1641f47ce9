"""`callboard action echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.named import ACTION
from actors.cli.parsing import Options, Parser, add_broker_options, add_print_options, add_qos_options

if TYPE_CHECKING:
    from actors.cli.echoing import EchoedTopic
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.node.node import Node

EXAMPLES: Final = {"callboard action echo /fibonacci": "the feedback and the states of all its goals"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("action", metavar="ACTION", help=f"such as {ACTION.example}")
    parser.add_argument(
        "type",
        metavar="TYPE",
        nargs="?",
        help=f"such as {ACTION.example_type}; with it, an action may be yet to come",
    )
    add_print_options(parser)
    add_qos_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print messages until --once, a timeout or a signal ends it."""
    from actors.cli.echoing import EchoedTopic, echo
    from actors.cli.values import named_action
    from actors.interfaces.action import action_types
    from actors.interfaces.action_msgs.msg import GoalStatusArray
    from actors.tools.generic_subscription import decoder_of

    action_type: Any = None if options.type is None else named_action(options.type, options)

    def echoed_topics(node: Node, snapshot: GraphSnapshot) -> list[EchoedTopic]:
        name = node.resolve_topic_name(options.action)
        feedback_type: type[Message] | None = None
        if action_type is None:
            _require_known(snapshot, name)
        else:
            feedback_type = action_types(action_type).feedback_message
        feedback, status = f"{name}/_action/feedback", f"{name}/_action/status"
        return [
            EchoedTopic(feedback, decoder_of(snapshot, feedback), feedback_type),
            EchoedTopic(status, decoder_of(snapshot, status), GoalStatusArray),
        ]

    return echo(options, echoed_topics)


def _require_known(snapshot: GraphSnapshot, action: str) -> None:
    from actors.cli.named import unknown

    known = dict(ACTION.names_and_types(snapshot))
    if action not in known:
        remedy = f"; to wait for it, name its type: callboard action echo {action} TYPE"
        raise unknown(f"Unknown action '{action}'{remedy}", action, known)
