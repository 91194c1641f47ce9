"""`callboard service call`."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.cli.errors import TIMEOUT, CommandError
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.parsing import did_you_mean
from actors.cli.session import graph_of, session
from actors.cli.values import message_from_text, named_service
from actors.errors import RemoteError
from actors.interfaces.convert import message_to_ordereddict
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse

    from actors.entities.client import Client
    from actors.interfaces.message import Message
    from actors.node import Node


def run(options: argparse.Namespace) -> int:
    """Call once, or again and again."""
    srv_type: Any = named_service(options.type)
    request: Message = message_from_text(srv_type.Request, options.values)
    run_async(lambda: _call(options, srv_type, request))
    return 0


async def _call(options: argparse.Namespace, srv_type: Any, request: Message) -> None:
    loop = asyncio.get_running_loop()
    async with session(options) as node:
        client: Client[Any, Any] = node.create_client(srv_type, options.service)
        await _wait_for_server(options, node, client)
        due = loop.time()
        while True:
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
            if options.rate is None:
                return
            due += 1 / options.rate
            await asyncio.sleep(max(0.0, due - loop.time()))


async def _wait_for_server(options: argparse.Namespace, node: Node, client: Client[Any, Any]) -> None:
    picture = await graph_of(node)  # the broker's answer comes after what it has to say about the client
    if client.service_is_ready():
        return
    if picture.count(EntryKind.SERVICE, client.srv_name):
        hint = ""  # there is one, of another type: the broker has warned
    else:
        hint = did_you_mean(client.srv_name, dict(picture.names_and_types(EntryKind.SERVICE)))
    waiting = f"waiting for service to become available...{hint.lstrip(';')}"
    (note if options.json else say)(waiting)
    if not await client.wait_for_service(options.timeout):
        raise CommandError(
            f"Service '{client.srv_name}' has no server of type {options.type} after {options.timeout:g} s",
            TIMEOUT,
        )
