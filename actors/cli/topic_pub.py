"""`callboard topic pub`."""

from __future__ import annotations

import asyncio
import time
from contextlib import aclosing
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.cli.errors import TIMEOUT, USAGE, CommandError
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.pace import Pace
from actors.cli.session import session
from actors.cli.stdin import documents
from actors.cli.values import named_message, profile, stamped_message_from_text
from actors.errors import WaitTimeout
from actors.interfaces.convert import message_to_ordereddict
from actors.qos.profile import QoSProfile

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator

    from actors.endpoints.publisher.publisher import Publisher
    from actors.interfaces.message import Message
    from actors.tools.stamps import Stamps

FLUSH_TIMEOUT_SEC: Final = 5.0
FOREVER_SEC: Final = 1e9
DEFAULT_HZ: Final = 1.0


class Said(NamedTuple):
    """A message to publish, and where in it the time is to be filled in."""

    message: Message
    stamps: Stamps


def run(options: argparse.Namespace) -> int:
    """Publish as often as asked."""
    msg_type = named_message(options.type)
    if options.stdin and options.values is not None:
        raise CommandError("Give VALUES or --stdin, not both", USAGE)
    said = None if options.stdin else _said(msg_type, options.values or "{}")
    run_async(lambda: _publish(options, msg_type, said))
    return 0


async def _publish(options: argparse.Namespace, msg_type: type[Message], said: Said | None) -> None:
    async with session(options, name=options.node_name) as node:
        publisher = node.create_publisher(msg_type, options.topic, profile(options, QoSProfile(depth=10)))
        await _wait_for_subscriptions(options, publisher)
        if not options.json:
            say("publisher: beginning loop")
        if said is None:
            async with aclosing(documents(partial(_said, msg_type))) as messages:
                await _repeat(options, publisher, messages, options.rate)
        else:
            async with aclosing(_again(said)) as messages:
                await _repeat(options, publisher, messages, options.rate or DEFAULT_HZ)
        await publisher.flush(FLUSH_TIMEOUT_SEC)
        if options.keep_alive:
            await asyncio.sleep(options.keep_alive)


def _said(msg_type: type[Message], text: str) -> Said:
    return Said(*stamped_message_from_text(msg_type, text))


async def _again(said: Said) -> AsyncGenerator[Said]:
    while True:
        yield said


async def _wait_for_subscriptions(options: argparse.Namespace, publisher: Publisher[Message]) -> None:
    limited = options.once or options.times is not None
    wanted = options.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if limited else 0
    if not wanted:
        return
    await publisher.context.link.round_trip()  # the broker has said who is there
    if publisher.get_subscription_count() >= wanted:
        return
    note(f"Waiting for at least {wanted} matching subscription(s) on {publisher.topic_name}...")
    limit = FOREVER_SEC if options.timeout is None else options.timeout
    try:
        await publisher.context.wait_until(
            lambda: publisher.get_subscription_count() >= wanted, "Matching subscriptions", limit
        )
    except WaitTimeout:
        found = publisher.get_subscription_count()
        raise CommandError(
            f"Only {found} of {wanted} subscription(s) on {publisher.topic_name} within {limit:g} s",
            TIMEOUT,
        ) from None


async def _repeat(
    options: argparse.Namespace,
    publisher: Publisher[Message],
    messages: AsyncGenerator[Said],
    rate: float | None,
) -> None:
    """Publish at the rate asked for, without drift; end after as many messages as asked for."""
    loop = asyncio.get_running_loop()
    times = 1 if options.once else options.times
    pace = None if rate is None else Pace(rate, loop.time)
    number = 0
    async for message, stamps in messages:
        number += 1
        await publisher.ready(FOREVER_SEC)
        stamps.set(message, time.time_ns())
        publisher.publish(message)
        if number % options.print == 0:
            if options.json:
                say_json({"number": number, "message": message_to_ordereddict(message)})
            else:
                say(f"publishing #{number}: {message!r}\n")
        if number == times:
            return
        if pace is not None:
            await asyncio.sleep(pace.wait_sec())
