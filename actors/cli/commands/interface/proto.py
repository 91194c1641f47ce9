"""`callboard interface proto`."""

from __future__ import annotations

from typing import Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

EXAMPLES: Final = {
    "callboard interface proto geometry_msgs/msg/Twist": "values to fill in for topic pub",
    "callboard interface proto --no-quotes std_srvs/srv/SetBool": "the request of a service, as plain YAML",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "type",
        metavar="TYPE",
        help="such as std_msgs/msg/String; of a service the request, of an action the goal",
    )
    parser.add_flag("--no-quotes", help="without quotes around it")
    add_json_option(parser, "the message as one object")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the message, request or goal with its default values."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_json, print_out
    from actors.cli.values import named_interface
    from actors.interfaces.convert import message_from_fields, message_to_ordereddict, message_to_yaml
    from actors.interfaces.message import Action, Service

    sent: Any = named_interface(options.type, options)
    if issubclass(sent, Service | Action):
        sent = getattr(sent, "Request" if issubclass(sent, Service) else "Goal")
    try:
        message = message_from_fields(sent, {})
    except ValueError as error:
        raise CommandError(str(error)) from None
    if options.json:
        print_json(message_to_ordereddict(message))
    elif options.no_quotes:
        print_out(message_to_yaml(message).rstrip("\n"))
    else:
        print_out(f'"{message_to_yaml(message)}"')
    return 0
