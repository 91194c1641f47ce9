"""`callboard topic pub`."""

from __future__ import annotations

import asyncio
from itertools import count
from typing import TYPE_CHECKING, Final

from actors.cli.errors import TIMEOUT, CommandError
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.session import session
from actors.cli.values import message_from_text, named_message, profile
from actors.errors import WaitTimeout
from actors.interfaces.convert import message_to_ordereddict
from actors.qos import QoSProfile

if TYPE_CHECKING:
    import argparse

    from actors.entities.publisher import Publisher
    from actors.interfaces.message import Message

FLUSH_TIMEOUT_SEC: Final = 5.0
FOREVER_SEC: Final = 1e9


def run(options: argparse.Namespace) -> int:
    """Publish as often as asked."""
    message = message_from_text(named_message(options.type), options.values)
    run_async(lambda: _publish(options, message))
    return 0


async def _publish(options: argparse.Namespace, message: Message) -> None:
    async with session(options) as node:
        qos = profile(options, QoSProfile(depth=10))
        publisher = node.create_publisher(type(message), options.topic, qos)
        await _wait_for_subscriptions(options, publisher)
        if not options.json:
            say("publisher: beginning loop")
        await _repeat(options, publisher, message)
        await publisher.flush(FLUSH_TIMEOUT_SEC)


async def _wait_for_subscriptions(options: argparse.Namespace, publisher: Publisher[Message]) -> None:
    limited = options.once or options.times is not None
    wanted = options.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if limited else 0
    if not wanted:
        return
    await publisher.core.link.round_trip()  # the broker has said who is there
    if publisher.get_subscription_count() >= wanted:
        return
    note(f"Waiting for at least {wanted} matching subscription(s) on {publisher.topic_name}...")
    limit = FOREVER_SEC if options.timeout is None else options.timeout
    try:
        await publisher.core.wait_until(
            lambda: publisher.get_subscription_count() >= wanted, "Matching subscriptions", limit
        )
    except WaitTimeout:
        found = publisher.get_subscription_count()
        raise CommandError(
            f"Only {found} of {wanted} subscription(s) on {publisher.topic_name} within {limit:g} s",
            TIMEOUT,
        ) from None


async def _repeat(options: argparse.Namespace, publisher: Publisher[Message], message: Message) -> None:
    """Publish at the rate asked for, without drift; end after as many messages as asked for."""
    loop = asyncio.get_running_loop()
    times = 1 if options.once else options.times
    due = loop.time()
    for number in count(1):
        await publisher.ready(FOREVER_SEC)
        publisher.publish(message)
        if number % options.print == 0:
            if options.json:
                say_json({"number": number, "message": message_to_ordereddict(message)})
            else:
                say(f"publishing #{number}: {message!r}\n")
        if number == times:
            return
        due += 1 / options.rate
        await asyncio.sleep(max(0.0, due - loop.time()))
