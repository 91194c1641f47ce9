"""What the verbs of `callboard param` share: the node, its parameter client, and the texts of types."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import Options, Parser, add_broker_options, positive

# Reading arguments needs nothing else.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Coroutine

    from actors.config.contexts import BrokerTarget
    from actors.graph.snapshot import GraphSnapshot
    from actors.parameter_client.client import ParameterClient
    from actors.parameters.types import SetParametersResult

TIMEOUT_SEC: Final = 5.0
TYPE_NAMES: Final = (
    "not set", "boolean", "integer", "double", "string", "byte array", "boolean array", "integer array",
    "double array", "string array",
)  # fmt: skip
"""By ROS 2's number of the type."""


def add_node_argument(parser: Parser) -> None:
    """Add the node's name."""
    parser.add_argument("node", metavar="NODE", help="such as /talker")


def add_parameter_options(parser: Parser) -> None:
    """Add the options that all verbs have."""
    parser.add_flag("--include-hidden-nodes", help="also a node with a leading _")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC", default=TIMEOUT_SEC,
        help=f"end with 124 if there is no answer within this time; default: {TIMEOUT_SEC:g}",
    )  # fmt: skip
    add_broker_options(parser)


def run_with_client(
    options: Options, command: Callable[[ParameterClient], Coroutine[None, None, int]]
) -> int:
    """Run a command with a client of the node that the options name; return its exit code.

    Raises:
        CommandError: There is no such node, it does not serve its parameters, or does not answer in time.
    """
    from actors.cli.loop import run_async

    async def run() -> int:
        async with parameter_client(options) as client:
            return await command(client)

    return run_async(run)


@asynccontextmanager
async def parameter_client(options: Options) -> AsyncGenerator[ParameterClient]:
    """Yield a client of the node that the options name, until the options' timeout."""
    from actors.cli.errors import TIMEOUT, USAGE, CommandError
    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.named import absolute, unknown
    from actors.errors import RemoteError, ServiceUnavailable
    from actors.parameter_client.client import ParameterClient

    if not options.node.strip("/"):
        raise CommandError("Which node? Write its full name, such as /talker", USAGE)
    name = absolute(options.node)
    try:
        async with asyncio.timeout(options.timeout), hidden_node(options) as node:
            nodes = visible_nodes(await graph_of(node), hidden=options.include_hidden_nodes)
            if name not in nodes:
                raise unknown(f"Node not found: '{name}'", name, nodes)
            yield ParameterClient(node, name)
    except TimeoutError:
        raise CommandError(f"Node '{name}' has not answered within {options.timeout:g} s", TIMEOUT) from None
    except RemoteError as error:
        raise CommandError(f"Node '{name}' failed: {error}") from None
    except ServiceUnavailable as error:
        raise CommandError(f"The parameters of '{name}' cannot be reached: {error}") from None


def names_to_complete(target: BrokerTarget, name: str, timeout_sec: float) -> list[str]:
    """Return the names of a node's parameters, for completion; none if it does not answer in time.

    Raises:
        CallboardError: The broker or the node cannot be reached.
    """
    from actors.cli.hidden_node import make_hidden_node
    from actors.logging.logger import LoggingSeverity
    from actors.parameter_client.client import ParameterClient

    async def names() -> list[str]:
        node = make_hidden_node(target, connect_timeout_sec=timeout_sec, stop_timeout_sec=0)
        node.get_logger().set_level(LoggingSeverity.FATAL)
        try:
            async with asyncio.timeout(timeout_sec), node:
                return (await ParameterClient(node, name).list_parameters()).names
        except TimeoutError:
            return []

    return asyncio.run(names())


def visible_nodes(snapshot: GraphSnapshot, *, hidden: bool) -> list[str]:
    """Return the names of nodes, without hidden ones unless they are wanted."""
    from proto.names import is_hidden

    return [name for name in snapshot.nodes() if hidden or not is_hidden(name)]


def report(result: SetParametersResult, done: str, failed: str) -> int:
    """Print how setting a parameter has ended; return the exit code."""
    from actors.cli.output import print_err, print_out

    reason = f": {result.reason}" if result.reason else ""
    if result.successful:
        print_out(done + reason)
        return 0
    print_err(failed + reason)
    return 1
