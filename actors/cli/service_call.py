"""`callboard service call`."""

from __future__ import annotations

import asyncio
from contextlib import aclosing
from functools import partial
from typing import TYPE_CHECKING, Any

from actors.cli.errors import TIMEOUT, USAGE, CommandError
from actors.cli.loop import run_async
from actors.cli.mismatch import require_type
from actors.cli.output import note, say, say_json
from actors.cli.pace import Pace
from actors.cli.session import graph_of, session
from actors.cli.stdin import documents
from actors.cli.values import message_from_text, named_service
from actors.errors import RemoteError
from actors.interfaces.convert import message_to_ordereddict
from actors.tools.suggestions import did_you_mean
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator

    from actors.endpoints.client.client import Client
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message


def run(options: argparse.Namespace) -> int:
    """Call once, or again and again."""
    srv_type: Any = named_service(options.type)
    if options.stdin and options.values is not None:
        raise CommandError("Give VALUES or --stdin, not both", USAGE)
    request = None if options.stdin else message_from_text(srv_type.Request, options.values or "{}")
    run_async(lambda: _call(options, srv_type, request))
    return 0


async def _call(options: argparse.Namespace, srv_type: Any, request: Message | None) -> None:
    loop = asyncio.get_running_loop()
    pace = None if options.rate is None else Pace(options.rate, loop.time)
    async with session(options) as node:
        snapshot = await graph_of(node)
        # Without a client yet: the broker would warn both sides of one with another type.
        require_type(snapshot, EntryKind.SERVICE, node.resolve_service_name(options.service), srv_type)
        client: Client[Any, Any] = node.create_client(srv_type, options.service)
        await _wait_for_server(options, snapshot, client)
        if request is None:
            coming = documents(partial(message_from_text, srv_type.Request))
        else:
            coming = _again(request, once=pace is None)
        async with aclosing(coming) as requests:
            async for each in requests:
                await _call_once(options, client, each)
                if pace is not None:
                    await asyncio.sleep(pace.wait_sec())


async def _again(request: Message, *, once: bool) -> AsyncGenerator[Message]:
    yield request
    while not once:
        yield request


async def _call_once(options: argparse.Namespace, client: Client[Any, Any], request: Message) -> None:
    if not options.json:
        say(f"requester: making request: {request!r}\n")
    try:
        response = await client.call(request, options.timeout)
    except RemoteError as error:
        raise CommandError(f"Service '{client.srv_name}' failed: {error}") from None
    if options.json:
        say_json(message_to_ordereddict(response))
    else:
        say(f"response:\n{response!r}\n")


async def _wait_for_server(
    options: argparse.Namespace, snapshot: GraphSnapshot, client: Client[Any, Any]
) -> None:
    if not snapshot.count(EntryKind.SERVICE, client.srv_name):
        hint = did_you_mean(client.srv_name, dict(snapshot.names_and_types(EntryKind.SERVICE)))
        (note if options.json else say)(f"waiting for service to become available...{hint.lstrip(';')}")
    if not await client.wait_for_service(options.timeout):
        raise CommandError(
            f"Service '{client.srv_name}' has no server of type {options.type} after {options.timeout:g} s",
            TIMEOUT,
        )
