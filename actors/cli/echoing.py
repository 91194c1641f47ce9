"""Print received messages: `topic echo`, `service echo` and `action echo`."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.hidden_node import graph_of, hidden_node
from actors.cli.loop import run_async
from actors.cli.message_printer import MessagePrinter
from actors.cli.parsing import import_from_working_directory
from actors.cli.subscriber import Listener
from actors.cli.values import profile
from actors.tools.generic_subscription import profile_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.cli.parsing import Options
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.node.node import Node

DEPTH: Final = 1000
"""Messages queued for a slow terminal."""


class EchoedTopic(NamedTuple):
    """What to print.

    Attributes:
        topic: The topic's full name.
        decode: Decodes a message's bytes.
        msg_type: The topic's type; None to receive bytes.
    """

    topic: str
    decode: Callable[[bytes], Any]
    msg_type: type[Message] | None = None


def echo(options: Options, echoed_topics: Callable[[Node, GraphSnapshot], list[EchoedTopic]]) -> int:
    """Print messages until `--once`, a timeout or a signal ends it; return the exit code.

    Args:
        options: Those of `add_print_options` and `add_qos_options`, `raw` and `no_lost_messages`.
        echoed_topics: Returns what to print; raises CommandError if it does not exist.
    """
    printer = MessagePrinter(options)

    async def receive() -> None:
        async with hidden_node(options, name=options.node_name) as node:
            snapshot = await graph_of(node)
            topics = echoed_topics(node, snapshot)
            with Listener(
                node, timeout_sec=options.timeout, report_losses=not options.no_lost_messages
            ) as listener:

                def show(message: Any, info: MessageInfo, decode: Callable[[bytes], Any]) -> None:
                    if printer.show(message, info, decode) and options.once:
                        listener.enough()

                for topic, decode, msg_type in topics:
                    qos = profile(options, profile_of(snapshot, topic, depth=DEPTH))
                    callback = partial(show, decode=decode)
                    listener.subscribe(topic, callback, qos, msg_type=msg_type, raw=options.raw)
                await listener.wait()

    import_from_working_directory()
    run_async(receive)
    return 0
