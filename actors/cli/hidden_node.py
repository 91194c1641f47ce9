"""The node of a command: hidden, and with a short connection timeout."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors.cli.broker_target import CONNECT_TIMEOUT_SEC, target_of, why_unreachable
from actors.cli.errors import USAGE, CommandError
from actors.config import environment
from actors.errors import BrokerUnreachable
from actors.logging.output import configure_logging
from actors.logging.severity import LoggingSeverity
from actors.node.node import Node
from actors.tools.hidden_node import hidden_name, make_hidden_node

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator

    from actors.graph.snapshot import GraphSnapshot

NAME: Final = "callboard_cli"
"""The prefix of the names of the command line's hidden nodes."""
STOP_TIMEOUT_SEC: Final = 1.0


@asynccontextmanager
async def hidden_node(options: argparse.Namespace, *, name: str | None = None) -> AsyncGenerator[Node]:
    """Run a node on the broker that the options choose; with `--use-sim-time` its clock follows `/clock`.

    Args:
        options: The command line.
        name: The node's name; None for a hidden one.

    Raises:
        BrokerUnreachable: No broker answered within 2 s; the text says how to start one, or that another
            program has the port.
        ProtocolError: Another protocol is spoken there.
        InvalidUrlError: The URL is invalid.
    """
    if options.own_process:
        _set_up_log()
    target = target_of(options)
    use_sim_time = bool(getattr(options, "use_sim_time", False))
    if name is None:
        node = make_hidden_node(
            hidden_name(NAME),
            url=target.url,
            domain=target.domain,
            use_sim_time=use_sim_time,
            connect_timeout_sec=CONNECT_TIMEOUT_SEC,
            stop_timeout_sec=STOP_TIMEOUT_SEC,
        )
    else:
        node = Node(
            name,
            url=target.url,
            domain=target.domain,
            use_global_arguments=False,
            parameter_overrides={"use_sim_time": use_sim_time},
            connect_timeout_sec=CONNECT_TIMEOUT_SEC,
            stop_timeout_sec=STOP_TIMEOUT_SEC,
            slow_callback_sec=None,  # a terminal may be slow
        )
    log = node.get_logger()
    # The node would log each failed attempt; the error below has all details.
    log.set_level(LoggingSeverity.FATAL)
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT_SEC):
            await node.__aenter__()
    except (BrokerUnreachable, TimeoutError):
        raise await asyncio.to_thread(why_unreachable, target) from None
    log.set_level(LoggingSeverity.UNSET)
    async with _leaving(node):
        yield node


def _set_up_log() -> None:
    """Log warnings of the node and the library to stderr; CALLBOARD_LOG_LEVEL sets another level."""
    try:
        configure_logging(environment.log_level() or LoggingSeverity.WARN)
    except ValueError as error:
        raise CommandError(str(error), USAGE) from None


@asynccontextmanager
async def _leaving(node: Node) -> AsyncGenerator[None]:
    try:
        yield
    except BaseException as error:
        await node.__aexit__(type(error), error, error.__traceback__)
        raise
    await node.__aexit__(None, None, None)


async def graph_of(node: Node) -> GraphSnapshot:
    """Return the current graph, without the command's own node."""
    snapshot = await node.get_graph()
    own = node.get_fully_qualified_name()
    for key in [key for key, entry in snapshot.entries.items() if own in {entry.node, entry.name}]:
        del snapshot.entries[key]
    return snapshot
