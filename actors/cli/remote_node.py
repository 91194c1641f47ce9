"""Shared by verbs that ask one node, or all: its name on the command line, and the errors of its answers."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final, TypeVar

from actors.cli.parsing import Options, Parser, add_broker_options, add_ros_options, positive
from proto.wire.codes import EntryKind

# Reading arguments needs nothing else.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Awaitable, Callable
    from contextlib import AbstractAsyncContextManager

    from actors.errors import CallFailed
    from actors.node.node import Node

T = TypeVar("T")

TIMEOUT_SEC: Final = 5.0


def add_node_argument(parser: Parser) -> None:
    """Add the node's name."""
    parser.add_argument("node", metavar="NODE", help="such as /talker")


def add_remote_options(parser: Parser, *, timeout_sec: float = TIMEOUT_SEC, ros: bool = True) -> None:
    """Add the options that all such verbs have.

    Args:
        parser: The verb's.
        timeout_sec: The limit without `--timeout`.
        ros: ROS 2 has the verb, too.
    """
    parser.add_flag("--include-hidden-nodes", help="also a node with a leading _")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help="wait this long for the node to appear and to answer, then end with 124; "
        f"default: {timeout_sec:g} for the answer of a node that is there",
    )  # fmt: skip
    parser.set_defaults(default_timeout_sec=timeout_sec)
    if ros:
        add_ros_options(parser)
    add_broker_options(parser)


def time_limit(options: Options) -> float:
    """Return how many seconds the verb may take."""
    seconds: float = options.timeout or options.default_timeout_sec
    return seconds


@asynccontextmanager
async def remote_node(
    options: Options, what: str, service: str, reason: str
) -> AsyncGenerator[tuple[Node, str]]:
    """Yield a hidden node, and the full name of the node that the options name, until the options' timeout.

    With --timeout the node may be yet to come; without, as in ROS 2, an unknown one is an error at once.

    Args:
        options: The command line.
        what: The thing that the node is asked for, for errors.
        service: The service below the node's name without which there is no such thing.
        reason: Why a node may have no such service, and what to do.

    Raises:
        CommandError: There is no such node, it does not serve this, or does not answer in time.
    """
    from actors.cli.errors import TIMEOUT, USAGE, CommandError
    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.named import absolute, unknown
    from actors.cli.node_names import visible_nodes
    from actors.errors import RemoteError, ServiceUnavailable

    if not options.node.strip("/"):
        raise CommandError("Which node? Write its full name, such as /talker", USAGE)
    name, limit = absolute(options.node), time_limit(options)
    failure = f"Node '{name}' has not answered within {limit:g} s"
    try:
        async with asyncio.timeout(limit), hidden_node(options) as node:
            snapshot = await graph_of(node)
            nodes = visible_nodes(snapshot, hidden=options.include_hidden_nodes)
            if name not in nodes:
                missing = unknown(f"Node not found: '{name}'", name, nodes)
                if not options.timeout or name in snapshot.nodes():  # the latter: it is hidden
                    raise missing
                unanswered, failure = failure, str(missing)
                await node.wait_for_node(name, None)
                failure = unanswered
            try:
                yield node, name
            except ServiceUnavailable as error:
                if (await graph_of(node)).count(EntryKind.SERVICE, f"{name}/{service}"):
                    raise CommandError(f"The {what} of '{name}' cannot be reached: {error}") from None
                raise CommandError(f"Node '{name}' has no {what}: {reason}") from None
    except TimeoutError:
        raise CommandError(failure, TIMEOUT) from None
    except RemoteError as error:
        raise CommandError(f"Node '{name}' failed: {error.type_name}: {error.text}") from None


def lifecycle_node(options: Options, what: str) -> AbstractAsyncContextManager[tuple[Node, str]]:
    """Return `remote_node` for what only lifecycle nodes have."""
    reason = "it is no lifecycle node; `callboard lifecycle nodes` lists those that are"
    return remote_node(options, what, "get_state", reason)


async def ask_all(
    options: Options, service: str, ask: Callable[[Node, str], Awaitable[T]]
) -> dict[str, T | CallFailed]:
    """Ask all nodes at once that have a service; one that does not answer does not keep the others back.

    Args:
        options: The command line.
        service: The last part of the service's name.
        ask: Asks one: the hidden node, and the node's full name. It ends within the options' timeout.

    Returns:
        By the names of the nodes, the answer, or why the node has not answered.

    Raises:
        CommandError: The graph was not received in time.
    """
    from actors.cli.errors import TIMEOUT, CommandError
    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.node_names import visible_nodes
    from actors.errors import CallFailed
    from proto.wire.codes import EntryKind

    async def answer(node: Node, name: str) -> T | CallFailed:
        try:
            return await ask(node, name)
        except CallFailed as error:
            return error

    limit = time_limit(options)
    try:
        async with asyncio.timeout(limit), hidden_node(options) as node:
            snapshot = await graph_of(node)
            served = {name for name, _ in snapshot.names_and_types(EntryKind.SERVICE)}
            visible = visible_nodes(snapshot, hidden=options.include_hidden_nodes)
            wanted = sorted({name for name in visible if f"{name}/{service}" in served})
            found = await asyncio.gather(*(answer(node, name) for name in wanted))
    except TimeoutError:
        raise CommandError(f"The graph was not received within {limit:g} s", TIMEOUT) from None
    return dict(zip(wanted, found, strict=True))


def print_failures(answers: dict[str, T | CallFailed]) -> dict[str, T]:
    """Print to stderr which nodes have not answered, and why; return the other answers."""
    from actors.cli.output import print_err
    from actors.errors import CallFailed

    good: dict[str, T] = {}
    for name, answer in answers.items():
        if isinstance(answer, CallFailed):
            print_err(f"Exception while calling service of node '{name}': {answer}")
        else:
            good[name] = answer
    return good
