"""`callboard auth check`."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.auth import add_file_option, rules_file
from actors.cli.parsing import Options, Parser, add_json_option

ACTIONS: Final = ("publish", "subscribe", "serve", "call", "see", "administer", "node")

EXAMPLES: Final = {
    "callboard auth check robot1 publish /cmd_vel": "may it, and which rule decides?",
    "callboard auth check robot1 call /dock --from 10.0.0.7 --node /robot1/nav": "from there, as that node",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("user", metavar="USER", help="the user's name")
    parser.add_argument("action", metavar="ACTION", choices=ACTIONS, help=f"one of {', '.join(ACTIONS)}")
    parser.add_argument("name", metavar="NAME", help="full name of a topic, service or node")
    parser.add_argument("--from", dest="origin", metavar="ADDRESS", help="default: this machine")
    parser.add_argument("--node", metavar="NODE", help="full name of the node that does it")
    add_file_option(parser)
    add_json_option(parser, "{allowed, reason}")


def run(options: Options) -> int:
    """Say whether a user may do something; the exit code is 1 if not."""
    from actors.cli.errors import FAILURE, OK, USAGE, CommandError
    from actors.cli.output import print_json, print_out
    from broker.access.files import load_rules
    from broker.access.origin import LOCAL, Origin
    from broker.access.rules import Action
    from proto.wire.addresses import parse_address
    from proto.wire.names import validate_full_topic_name

    for name in (options.name, options.node):
        if name is not None:
            validate_full_topic_name(name)
    try:
        origin = LOCAL if options.origin is None else Origin(address=parse_address(options.origin))
    except ValueError as error:
        raise CommandError(f"--from: {error}", USAGE) from error
    file = rules_file(options)
    principal = load_rules(file).principal(options.user, origin)
    if principal is None:
        raise CommandError(f"{file}: there is no user '{options.user}'")
    decision = principal.rights.decide(Action(options.action), options.name)
    if options.node is not None and decision.allowed:
        as_node = principal.rights.decide(Action.NODE, options.node)
        decision = decision if as_node.allowed else as_node
    if options.json:
        print_json(decision._asdict())
    else:
        print_out(f"{'allowed' if decision.allowed else 'denied'}: {decision.reason}")
    return OK if decision.allowed else FAILURE
