"""`callboard bag echo`: print the messages of a topic in a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.bag import arguments
from actors.cli.parsing import Options, Parser, add_field_options, add_print_options, not_negative

if TYPE_CHECKING:
    from actors.bags.reader import Reader

EXAMPLES: Final = {
    "callboard bag echo trip /chatter": "every message, printed as by callboard topic echo",
    "callboard bag echo trip /odom --field pose.pose.position --csv": "a part of each, comma-separated",
    "callboard bag echo trip /chatter --start-offset 5 --once -i": "the first after 5 s, with its times",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument(
        "--start-offset", type=not_negative, metavar="SEC", default=0.0,
        help="start this long after the first message of the bag",
    )  # fmt: skip
    add_print_options(parser, live=False)
    add_field_options(parser)
    parser.add_flag(*("-i", "--include-message-info"), help="also print times and number of each message")


def run(options: Options) -> int:
    """Print the messages."""
    from actors.bags.reader import Reader
    from actors.cli.message_printer import MessagePrinter
    from actors.endpoints.subscription.backlog import MessageInfo

    printer = MessagePrinter(options)
    with Reader(options.bag_path) as reader:
        start_ns = None
        if options.start_offset:
            start_ns = reader.summary().start_ns + round(options.start_offset * 10**9)
        _require_topic(reader, options.topic)
        for message in reader.messages([options.topic], start_ns):
            info = MessageInfo(message.publish_time_ns, message.log_time_ns, message.sequence, b"", "")
            if printer.show(message.data, info, message.topic.decoder()) and options.once:
                break
    return 0


def _require_topic(reader: Reader, topic: str) -> None:
    from actors.cli.errors import CommandError
    from actors.tools.suggestions import did_you_mean

    names = {each.name for each in reader.topics}
    if topic not in names:
        hint = did_you_mean(topic, names) or f"; see callboard bag info {reader.path}"
        raise CommandError(f"{reader.path} has no topic '{topic}'{hint}")
