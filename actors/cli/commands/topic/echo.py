"""`callboard topic echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import (
    Options,
    Parser,
    add_broker_options,
    add_field_options,
    add_node_name_option,
    add_print_options,
    add_qos_options,
    add_ros_options,
)
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.cli.echoing import EchoedTopic
    from actors.graph.snapshot import GraphSnapshot
    from actors.node.node import Node

EXAMPLES: Final = {
    "callboard topic echo /chatter": "every message, until Ctrl-C",
    "callboard topic echo /odom --field pose.pose.position --once": "a part of one message",
    "callboard topic echo /chatter --filter 'm.data > 3' --csv": "some messages, as comma-separated values",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument(
        "type",
        metavar="TYPE",
        nargs="?",
        help="such as std_msgs/msg/String; with it, a topic may be yet to come",
    )
    add_field_options(parser)
    parser.add_flag("--raw", help="the bytes as they travel (msgpack)")
    parser.add_flag(
        *("-i", "--include-message-info"), help="with times, number and publisher of each message"
    )
    parser.add_flag("-c", "--clear", help="clear the terminal before each message")
    add_node_name_option(parser)
    parser.add_flag("--no-lost-messages", help="say nothing of lost messages")
    add_print_options(parser)
    add_qos_options(parser)
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print messages until --once, a timeout or a signal ends it."""
    from actors.cli.echoing import EchoedTopic, echo
    from actors.cli.subscriber import warn_unpublished
    from actors.cli.values import named_message, require_type
    from actors.tools.generic_subscription import decoder_of

    msg_type = None if options.type is None else named_message(options.type, options)

    def echoed_topics(node: Node, snapshot: GraphSnapshot) -> list[EchoedTopic]:
        topic = node.resolve_topic_name(options.topic)
        if msg_type is None:
            _require_known(snapshot, topic)
        else:
            warn_unpublished(snapshot, topic)
            if not options.raw:  # which receives every type
                require_type(snapshot, EntryKind.PUBLISHER, topic, msg_type)
        return [EchoedTopic(topic, decoder_of(snapshot, topic), msg_type)]

    return echo(options, echoed_topics)


def _require_known(snapshot: GraphSnapshot, topic: str) -> None:
    from actors.cli.errors import CommandError
    from actors.tools.suggestions import did_you_mean

    known = dict(snapshot.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
    if snapshot.count(EntryKind.PUBLISHER, topic) or known.get(topic):
        return
    remedy = (
        did_you_mean(topic, known) or f"; to wait for it, name its type: callboard topic echo {topic} TYPE"
    )
    raise CommandError(
        f"Could not determine the type for the passed topic: nobody publishes '{topic}'{remedy}"
    )
