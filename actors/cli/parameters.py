"""The parameter client of a node, for the verbs of `callboard param`."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

# Reading arguments needs nothing else.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Coroutine

    from actors.cli.parsing import Options
    from actors.config.contexts import BrokerTarget
    from actors.parameter_client.client import ParameterClient
    from actors.parameters.types import SetParametersResult


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
    from actors.cli.remote_node import remote_node
    from actors.parameter_client.client import ParameterClient

    reason = "it does not serve them (start_parameter_services=False)"
    async with remote_node(options, "parameters", "get_parameters", reason) as (node, name):
        yield ParameterClient(node, name)


def names_to_complete(target: BrokerTarget, name: str, timeout_sec: float) -> list[str]:
    """Return the names of a node's parameters, for completion; none if it does not answer in time.

    Raises:
        CallboardError: The broker or the node cannot be reached.
    """
    from actors.cli.hidden_node import NAME
    from actors.logging.severity import LoggingSeverity
    from actors.parameter_client.client import ParameterClient
    from actors.tools.hidden_node import hidden_name, make_hidden_node

    async def names() -> list[str]:
        node = make_hidden_node(
            hidden_name(NAME),
            url=target.url,
            domain=target.domain,
            connect_timeout_sec=timeout_sec,
            stop_timeout_sec=0,
        )
        node.get_logger().set_level(LoggingSeverity.FATAL)
        try:
            async with asyncio.timeout(timeout_sec), node:
                return (await ParameterClient(node, name).list_parameters()).names
        except TimeoutError:
            return []

    return asyncio.run(names())


def report(result: SetParametersResult, done: str, failed: str) -> int:
    """Print how setting a parameter has ended; return the exit code."""
    from actors.cli.output import print_err, print_out

    reason = f": {result.reason}" if result.reason else ""
    if result.successful:
        print_out(done + reason)
        return 0
    print_err(failed + reason)
    return 1
