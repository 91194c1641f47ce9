"""`callboard interface proto`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from actors.cli.errors import CommandError
from actors.cli.output import say, say_json
from actors.cli.values import named_interface
from actors.interfaces.convert import message_from_fields, message_to_ordereddict, message_to_yaml
from actors.interfaces.message import Action, Message, Service

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a message with its defaults, to be filled in."""
    message = _blank(named_interface(options.type))
    if options.json:
        say_json(message_to_ordereddict(message))
    elif options.no_quotes:
        say(message_to_yaml(message).rstrip("\n"))
    else:
        say(f'"{message_to_yaml(message)}"')
    return 0


def _blank(found: Any) -> Message:
    """Return what people send: a message, a service's request, or an action's goal, with its defaults."""
    sent: type[Message] = found
    if issubclass(found, Service):
        sent = cast("Any", found).Request
    elif issubclass(found, Action):
        sent = cast("Any", found).Goal
    try:
        return message_from_fields(sent, {})
    except ValueError as error:
        raise CommandError(str(error)) from None
