"""`callboard topic echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import CommandError
from actors.cli.here import look_here
from actors.cli.listening import Listener, warn_unpublished
from actors.cli.loop import run_async
from actors.cli.message_printer import MessagePrinter
from actors.cli.mismatch import require_type
from actors.cli.session import graph_of, session
from actors.cli.values import named_message, profile
from actors.tools.hearing import decoder_of, profile_of
from actors.tools.suggestions import did_you_mean
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message

DEPTH: Final = 1000
"""A terminal is slow; a burst of this many messages is printed whole."""


def run(options: argparse.Namespace) -> int:
    """Print messages until one was enough, a timeout or a signal."""
    printer = MessagePrinter(options)
    look_here()
    msg_type = None if options.type is None else named_message(options.type)
    run_async(lambda: _echo(options, msg_type, printer))
    return 0


async def _echo(options: argparse.Namespace, msg_type: type[Message] | None, printer: MessagePrinter) -> None:
    async with session(options) as node:
        topic = node.resolve_topic_name(options.topic)
        snapshot = await graph_of(node)
        if msg_type is None:
            _require_type(snapshot, topic)
        else:
            warn_unpublished(snapshot, topic)
            if not options.raw:  # which hears every type
                require_type(snapshot, EntryKind.PUBLISHER, topic, msg_type)
        decode = decoder_of(snapshot, topic)
        qos = profile(options, profile_of(snapshot, topic, depth=DEPTH))
        with Listener(
            node, timeout_sec=options.timeout, tell_losses=not options.no_lost_messages
        ) as listener:

            def show(message: Any, info: MessageInfo) -> None:
                if printer.show(message, info, decode) and options.once:
                    listener.enough()

            listener.hear(topic, show, qos, msg_type=msg_type, raw=options.raw)
            await listener.wait()


def _require_type(snapshot: GraphSnapshot, topic: str) -> None:
    known = dict(snapshot.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
    if snapshot.count(EntryKind.PUBLISHER, topic) or known.get(topic):
        return
    remedy = (
        did_you_mean(topic, known) or f"; to wait for it, name its type: callboard topic echo {topic} TYPE"
    )
    raise CommandError(
        f"Could not determine the type for the passed topic: nobody publishes '{topic}'{remedy}"
    )
