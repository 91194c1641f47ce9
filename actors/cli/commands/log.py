"""`callboard log`: the log of all nodes, from `/rosout`."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import LOG_LEVELS, Options, Parser, add_broker_options, add_json_option, positive

if TYPE_CHECKING:
    from actors.cli.subscriber import Listener
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.rcl_interfaces.msg import Log

EXAMPLES: Final = {
    "callboard log": "what all nodes have logged in the last 10 s",
    "callboard log --follow --level warn": "warnings and errors, until Ctrl-C",
    "callboard log -f --node /talker --node /robot1": "the lines of a node, and of all nodes of a namespace",
}
TOPIC: Final = "/rosout"
DEPTH: Final = 100_000
"""Lines queued for a slow terminal: those of 100 nodes that log as much as is kept of each."""
LATCHED_SEC: Final = 5.0
"""Time for the lines that are kept."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--level", type=str.lower, choices=LOG_LEVELS, default="debug",
        help=f"the least severity: {', '.join(LOG_LEVELS)}; default: whatever the nodes log",
    )  # fmt: skip
    parser.add_argument(
        "--node", action="append", metavar="NODE", default=[],
        help="only this node with its child loggers, one of these (/talker/motor), or the nodes of this "
        "namespace; may be repeated",
    )  # fmt: skip
    parser.add_flag("-f", "--follow", help="go on with new lines, until Ctrl-C")
    parser.add_flag("-v", "--verbose", help="with the function, file and line of each call")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help=f"exit with 124 if the lines have not been received within this time; default: {LATCHED_SEC:g}. "
        "With --follow: if no node logs anything for this long; default: no limit",
    )  # fmt: skip
    add_json_option(parser, "one document per line")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the lines that nodes have logged, and with --follow those that they log."""
    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.loop import run_async
    from actors.cli.subscriber import Listener
    from actors.interfaces.rcl_interfaces.msg import Log
    from actors.qos.profile import DurabilityPolicy, QoSProfile

    qos = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)

    async def receive() -> None:
        async with hidden_node(options) as node:
            _check_names(options, await graph_of(node))
            printer = _LogPrinter(options)
            with Listener(node, timeout_sec=options.timeout if options.follow else None) as listener:
                listener.subscribe(TOPIC, printer.print_or_hold, qos, msg_type=Log)
                try:
                    await _receive_latched(options, listener)
                finally:
                    printer.print_sorted()
                if options.follow:
                    async for _ in listener.ticks(1.0):
                        listener.report_losses()

    run_async(receive)
    return 0


async def _receive_latched(options: Options, listener: Listener) -> None:
    """Wait for the lines that are kept of all nodes; with --follow, go on without them after a failure.

    Raises:
        BrokerUnreachable: The link broke.
        CommandError: They were not received in time.
    """
    from actors.cli.errors import TIMEOUT, CommandError
    from actors.errors import BrokerUnreachable

    limit = options.timeout or LATCHED_SEC
    try:
        async with asyncio.timeout(limit):
            await listener.receive_latched(TOPIC)
    except (TimeoutError, BrokerUnreachable) as error:
        if options.follow:
            return
        if isinstance(error, BrokerUnreachable):
            raise
        raise CommandError(f"Not all lines were received within {limit:g} s", TIMEOUT) from None


def _check_names(options: Options, snapshot: GraphSnapshot) -> None:
    """Check that each --node names a node, a child logger or a namespace. With --follow it may come later.

    Raises:
        CommandError: There is no node of this name.
    """
    from actors.cli.named import absolute, unknown
    from actors.cli.output import print_err
    from actors.tools.suggestions import did_you_mean

    nodes = snapshot.nodes()
    for name in map(absolute, options.node):
        below = f"{name.rstrip('/')}/"
        if any(f"{node}/".startswith(below) or below.startswith(f"{node}/") for node in nodes):
            continue
        if not options.follow:
            raise unknown(f"Node not found: '{name}'", name, nodes)
        print_err(f"WARNING: there is no node '{name}' yet{did_you_mean(name, nodes)}")


class _LogPrinter:
    """Prints lines; the first ones sorted by their time, as they come from each node in turn."""

    def __init__(self, options: Options) -> None:
        import sys

        from actors.cli.tables import colored
        from actors.logging.logger import node_logger_name
        from actors.logging.severity import severity_from_name

        self._json: bool = options.json
        self._verbose: bool = options.verbose
        self._color = colored(sys.stdout)
        self._least = int(severity_from_name(options.level)) if options.level != LOG_LEVELS[0] else 0
        names: list[str] = [node_logger_name(name) for name in options.node]
        self._prefixes = () if "" in names else tuple(f"{name}." for name in names)
        self._held: list[tuple[Log, MessageInfo]] | None = []

    def print_or_hold(self, line: Log, info: MessageInfo) -> None:
        """Print a line if it was asked for, or hold it."""
        if line.level < self._least:
            return
        if self._prefixes and not f"{line.name}.".startswith(self._prefixes):
            return
        if self._held is None:
            self._print(line, info)
        else:
            self._held.append((line, info))

    def print_sorted(self) -> None:
        """Print the lines that are held; print others as they come from now on."""
        held, self._held = self._held or [], None
        for line, info in sorted(held, key=lambda each: (each[0].stamp.sec, each[0].stamp.nanosec)):
            self._print(line, info)

    def _print(self, line: Log, info: MessageInfo) -> None:
        from actors.logging.terminal_text import log_line
        from actors.tools import node_documents

        if self._json:
            from actors.cli.output import print_json

            print_json(node_documents.log_line(line, info.publisher_node))
            return
        severity = node_documents.severity_name(line.level)
        stamp_ns = line.stamp.sec * 1_000_000_000 + line.stamp.nanosec
        text = f"{line.msg} ({line.function}() at {line.file}:{line.line})" if self._verbose else line.msg
        print(log_line(severity, stamp_ns, line.name, text, color=self._color))
