"""Printing what a subscription receives: `topic echo` and `service echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.hidden_node import graph_of, hidden_node
from actors.cli.loop import run_async
from actors.cli.message_printer import MessagePrinter
from actors.cli.parsing import import_from_working_directory
from actors.cli.subscriber import Listener
from actors.cli.values import profile
from actors.tools.hearing import profile_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.cli.parsing import Options
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.node.node import Node

DEPTH: Final = 1000
"""A terminal is slow; a burst of this many messages is printed whole."""


class Source(NamedTuple):
    """What to print: a topic's full name, what reads its bytes, and its type if it is not to be found out."""

    topic: str
    decode: Callable[[bytes], Any]
    msg_type: type[Message] | None = None


def echo(options: Options, source_of: Callable[[Node, GraphSnapshot], Source]) -> int:
    """Print messages until one was enough, a timeout or a signal; return the exit code.

    Args:
        options: What `add_print_options` and `add_qos_options` add, `raw` and `no_lost_messages`.
        source_of: Says what to print; raises CommandError if that is not there.
    """
    printer = MessagePrinter(options)

    async def receive() -> None:
        async with hidden_node(options) as node:
            snapshot = await graph_of(node)
            topic, decode, msg_type = source_of(node, snapshot)
            qos = profile(options, profile_of(snapshot, topic, depth=DEPTH))
            with Listener(
                node, timeout_sec=options.timeout, report_losses=not options.no_lost_messages
            ) as listener:

                def show(message: Any, info: MessageInfo) -> None:
                    if printer.show(message, info, decode) and options.once:
                        listener.enough()

                listener.subscribe(topic, show, qos, msg_type=msg_type, raw=options.raw)
                await listener.wait()

    import_from_working_directory()
    run_async(receive)
    return 0
