"""`callboard service call`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import TIMEOUT, USAGE, CommandError
from actors.cli.output import print_err, print_json, print_out
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, positive
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors.endpoints.client.client import Client
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message

EXAMPLES: Final = {
    "callboard service call /add_two_ints example_interfaces/srv/AddTwoInts '{a: 5, b: 3}'": (
        "one call; the answer is printed"
    ),
    "callboard service call --stdin /add_two_ints example_interfaces/srv/AddTwoInts --json": (
        'a call for each line such as {"a": 5, "b": 3}, a line for each answer'
    ),
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="NAME", help="such as /add_two_ints")
    parser.add_argument("type", metavar="TYPE", help="such as example_interfaces/srv/AddTwoInts")
    parser.add_argument("values", metavar="VALUES", nargs="?", help="a YAML map: '{a: 5, b: 3}'; default: {}")
    parser.add_flag(
        "--stdin",
        help="call with what comes on stdin, one after the other: YAML with --- in between, or a JSON object "
        "a line",
    )
    parser.add_argument(
        "-r",
        "--rate",
        type=positive,
        metavar="HZ",
        help="call again and again; with --stdin, at most so often",
    )
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help="end with 124 when no server comes, or no reply, within this time; default: for a reply 60",
    )  # fmt: skip
    add_json_option(parser, "the response alone")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Call once, or again and again."""
    from actors.cli.loop import run_async
    from actors.cli.values import message_from_text, named_service

    srv_type: Any = named_service(options.type, options)
    if options.stdin and options.values is not None:
        raise CommandError("Give VALUES or --stdin, not both", USAGE)
    request = None if options.stdin else message_from_text(srv_type.Request, options.values or "{}")
    run_async(lambda: _call(options, srv_type, request))
    return 0


async def _call(options: Options, srv_type: Any, request: Message | None) -> None:
    from contextlib import aclosing
    from functools import partial

    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.rate_limit import RateLimit
    from actors.cli.stdin import documents
    from actors.cli.values import message_from_text, require_type

    rate_limit = RateLimit(options.rate)
    async with hidden_node(options) as node:
        snapshot = await graph_of(node)
        # Without a client yet: the broker would warn both sides of one with another type.
        require_type(snapshot, EntryKind.SERVICE, node.resolve_service_name(options.service), srv_type)
        client: Client[Any, Any] = node.create_client(srv_type, options.service)
        await _wait_for_server(options, snapshot, client)
        if request is None:
            coming = documents(partial(message_from_text, srv_type.Request))
        else:
            coming = _repeat(request, once=options.rate is None)
        async with aclosing(coming) as requests:
            async for each in requests:
                await _call_once(options, client, each)
                await rate_limit.wait()


async def _repeat(request: Message, *, once: bool) -> AsyncGenerator[Message]:
    yield request
    while not once:
        yield request


async def _call_once(options: Options, client: Client[Any, Any], request: Message) -> None:
    from actors.errors import RemoteError
    from actors.interfaces.convert import message_to_ordereddict
    from actors.time.timeout import DEFAULT_TIMEOUT

    if not options.json:
        print_out(f"requester: making request: {request!r}\n")
    try:
        response = await client.call(request, options.timeout or DEFAULT_TIMEOUT)
    except RemoteError as error:
        raise CommandError(str(error)) from None
    if options.json:
        print_json(message_to_ordereddict(response))
    else:
        print_out(f"response:\n{response!r}\n")


async def _wait_for_server(options: Options, snapshot: GraphSnapshot, client: Client[Any, Any]) -> None:
    from actors.tools.suggestions import did_you_mean

    if not snapshot.count(EntryKind.SERVICE, client.srv_name):
        hint = did_you_mean(client.srv_name, dict(snapshot.names_and_types(EntryKind.SERVICE)))
        (print_err if options.json else print_out)(
            f"waiting for service to become available...{hint.lstrip(';')}"
        )
    if not await client.wait_for_service(options.timeout):
        raise CommandError(
            f"Service '{client.srv_name}' has no server of type {options.type} after {options.timeout:g} s",
            TIMEOUT,
        )
