"""`callboard topic echo`."""

from __future__ import annotations

import asyncio
import base64
import re
from contextlib import aclosing
from typing import TYPE_CHECKING, Any, Final, cast

from actors.cli.errors import TIMEOUT, CommandError
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.parsing import did_you_mean
from actors.cli.session import graph_of, session
from actors.cli.values import named_message, profile
from actors.interfaces.convert import message_to_csv, message_to_ordereddict, message_to_yaml
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.tools.hearing import decoder_of, profile_of
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator, Callable

    from actors.entities.subscription import Subscription
    from actors.picture import GraphPicture

DEPTH: Final = 1000
"""A terminal is slow; a burst of this many messages is printed whole."""
_FIELD: Final = re.compile(r"\w+(\[\d+\])*(\.\w+(\[\d+\])*)*")


def run(options: argparse.Namespace) -> int:
    """Print messages until one was enough, a timeout or a signal."""
    if options.field is not None and not _FIELD.fullmatch(options.field):
        raise CommandError(f"Invalid field value '{options.field}'")
    msg_type = None if options.type is None else named_message(options.type)
    run_async(lambda: _echo(options, msg_type))
    return 0


async def _echo(options: argparse.Namespace, msg_type: type[Message] | None) -> None:
    async with session(options) as node:
        topic = node.resolve_topic_name(options.topic)
        picture = await graph_of(node)
        _check_topic(picture, topic, msg_type)
        decode = decoder_of(picture, topic)
        subscription = node.create_subscription(
            msg_type,
            topic,
            qos=profile(options, profile_of(picture, topic, depth=DEPTH)),
            raw=options.raw or msg_type is None,
        )
        printer = _Printer(options, decode)
        try:
            await _print_all(options, subscription, printer)
        finally:
            lost = subscription.dropped + subscription.lost
            if lost:
                note(f"{lost} messages of {topic} were not printed: too fast, or lost on the way")


async def _print_all(options: argparse.Namespace, subscription: Subscription[Any], printer: _Printer) -> None:
    # An async generator in all but its declared type.
    async with aclosing(cast("AsyncGenerator[Any, None]", aiter(subscription))) as messages:
        while True:
            try:
                async with asyncio.timeout(options.timeout):
                    message = await anext(messages)
            except TimeoutError:
                text = f"No message on {subscription.topic_name} within {options.timeout:g} s"
                raise CommandError(text, TIMEOUT) from None
            printer.show(message)
            if options.once:
                return


def _check_topic(picture: GraphPicture, topic: str, msg_type: type[Message] | None) -> None:
    known = dict(picture.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
    if picture.count(EntryKind.PUBLISHER, topic):
        return
    hint = did_you_mean(topic, known)
    if msg_type is not None:
        note(f"WARNING: topic [{topic}] does not appear to be published yet{hint}")
    elif not known.get(topic):
        remedy = hint or f"; to wait for it, name its type: callboard topic echo {topic} TYPE"
        raise CommandError(
            f"Could not determine the type for the passed topic: nobody publishes '{topic}'{remedy}"
        )


class _Printer:
    """Prints one message after the other as the options want it."""

    def __init__(self, options: argparse.Namespace, decode: Callable[[bytes], Any]) -> None:
        self._options = options
        self._decode = decode
        self._shortened: dict[str, Any] = {
            "truncate_length": None if options.full_length else options.truncate_length,
            "no_arr": options.no_arr,
            "no_str": options.no_str,
        }

    def show(self, message: Any) -> None:
        """Print a message: an instance of its class, or its bytes."""
        options = self._options
        if options.raw:
            self._show_raw(message)
            return
        if isinstance(message, bytes):
            try:
                message = self._decode(message)
            except InvalidMessageError as error:
                note(str(error))
                return
        value = message if options.field is None else _part(message, options.field)
        if options.json:
            say_json(message_to_ordereddict({"value": value})["value"])
        elif not isinstance(value, Message | dict):
            say(str(message_to_ordereddict({"value": value}, **self._shortened)["value"]))
        elif options.csv:
            say(message_to_csv(cast("Any", value), **self._shortened))
            return
        else:
            text = message_to_yaml(cast("Any", value), flow_style=options.flow_style, **self._shortened)
            say(text.rstrip("\n"))
        if not options.json and not options.csv:
            say("---")

    def _show_raw(self, data: bytes) -> None:
        if self._options.json:
            say_json({"msgpack": base64.b64encode(data).decode()})
        else:
            say(f"{data!r}\n---")


def _part(message: Any, path: str) -> Any:
    """Return the value at `path`.

    Raises:
        CommandError: There is no such field.
    """
    value = message
    for step in re.findall(r"\w+", path):
        try:
            if isinstance(value, dict):
                value = cast("dict[str, Any]", value)[step]
            elif isinstance(value, Message):
                value = getattr(value, step if step in value.__struct_fields__ else "")
            else:
                value = value[int(step)]
        except (AttributeError, IndexError, KeyError, TypeError, ValueError):
            raise CommandError(f"Invalid field '{path}': there is no '{step}' in it") from None
    return value
