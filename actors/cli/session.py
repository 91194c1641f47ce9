"""A command's place in the graph: a hidden node that gives up soon if there is no broker."""

from __future__ import annotations

import asyncio
import os
import secrets
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors import environment
from actors.errors import BrokerUnreachable
from actors.logger import LoggingSeverity
from actors.node import Node
from proto.url import DEFAULT_PORT, DEFAULT_URL, parse_urls

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator

    from actors.graph import GraphPicture
    from proto.url import BrokerUrl

CONNECT_TIMEOUT_SEC: Final = 2.0
STOP_TIMEOUT_SEC: Final = 1.0
_HERE: Final = {"127.0.0.1", "::1", "localhost"}


@asynccontextmanager
async def session(options: argparse.Namespace) -> AsyncGenerator[Node]:
    """Join the graph that `--url` and `--domain` name, as a hidden node.

    Raises:
        BrokerUnreachable: No broker within 2 s; the text says how to start one.
        InvalidUrlError: The URL cannot be read.
    """
    urls = parse_urls(options.url or environment.broker_url() or DEFAULT_URL)
    # A process id alone is not unique: in a container it is 1.
    name = f"_callboard_cli_{os.getpid()}_{secrets.token_hex(3)}"
    node = Node(
        name,
        url=",".join(map(str, urls)),
        domain=options.domain,
        use_global_arguments=False,
        connect_timeout_sec=CONNECT_TIMEOUT_SEC,
        stop_timeout_sec=STOP_TIMEOUT_SEC,
    )
    log = node.get_logger()
    log.set_level(LoggingSeverity.FATAL)  # the error below says it all
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT_SEC):
            await node.__aenter__()
    except (BrokerUnreachable, TimeoutError):
        raise BrokerUnreachable(missing_broker(urls)) from None
    log.set_level(LoggingSeverity.UNSET)
    async with _leaving(node):
        yield node


@asynccontextmanager
async def _leaving(node: Node) -> AsyncGenerator[None]:
    try:
        yield
    except BaseException as error:
        await node.__aexit__(type(error), error, error.__traceback__)
        raise
    await node.__aexit__(None, None, None)


def missing_broker(urls: tuple[BrokerUrl, ...]) -> str:
    """Say in one line that there is no broker, and what starts one."""
    return f"No broker at {', '.join(map(str, urls))}. Start one{_remedy(urls[0])}"


def _remedy(url: BrokerUrl) -> str:
    if url.path:
        return f" with: callboard broker --unix {url.path}"
    port = "" if url.port == DEFAULT_PORT else f" --port {url.port}"
    if url.host in _HERE:
        return f" with: callboard broker{port}"
    return f" there with: callboard broker --host {url.host}{port}"


async def graph_of(node: Node) -> GraphPicture:
    """Return the graph as it is now, without the command's own node."""
    picture = await node.get_graph()
    own = node.get_fully_qualified_name()
    for key in [key for key, entry in picture.entries.items() if own in {entry.node, entry.name}]:
        del picture.entries[key]
    return picture
