"""`callboard topic pub`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.errors import TIMEOUT, USAGE, CommandError
from actors.cli.output import print_err, print_json, print_out
from actors.cli.parsing import (
    Options,
    Parser,
    add_broker_options,
    add_json_option,
    add_node_name_option,
    add_qos_options,
    add_ros_options,
    count_or_zero,
    positive,
)
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors.endpoints.publisher.publisher import Publisher
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.time.clock import Clock
    from actors.tools.stamps import Stamps

    Stamped = tuple[Message, Stamps]
    """A message to publish, and the places where the time is filled in."""

EXAMPLES: Final = {
    "callboard topic pub /chatter std_msgs/msg/String '{data: hello}'": "once a second, until Ctrl-C",
    "callboard topic pub --once /chatter std_msgs/msg/String '{data: hello}'": (
        "one message, as soon as somebody listens"
    ),
    "callboard topic pub /head std_msgs/msg/Header '{stamp: now, frame_id: map}' -r 10": (
        "ten a second, each with the time at which it is sent"
    ),
    "callboard topic pub --stdin /copy std_msgs/msg/String": (
        "what stdin says, such as the output of `callboard topic echo --json /chatter`"
    ),
}


FLUSH_TIMEOUT_SEC: Final = 5.0
DEFAULT_HZ: Final = 1.0


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topic", metavar="TOPIC", help="such as /chatter")
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String")
    parser.add_argument(
        "values",
        metavar="VALUES",
        nargs="?",
        help="a YAML map: '{data: hello}'; 'auto' fills in a header, 'now' a time; default: {}",
    )
    parser.add_flag(
        "--stdin",
        help="publish what comes on stdin, as it comes: YAML with --- in between, or a JSON object a line",
    )
    _add_times(parser)
    add_json_option(parser, "one document a line")
    add_qos_options(parser)
    add_ros_options(parser, daemon=False, clock="'auto' and 'now' are the time of /clock")
    add_broker_options(parser)


def _add_times(parser: Parser) -> None:
    """Add the options for when, how often and how visibly it publishes."""
    parser.add_argument(
        "-r", "--rate", type=positive, metavar="HZ", help="a second; default: 1, with --stdin as they come"
    )
    times = parser.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", action="store_true", help="wait for a subscription, publish once, end")
    times.add_argument(
        "-t", "--times", type=count_or_zero, metavar="N", help="publish N times and end; 0: until Ctrl-C"
    )
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=count_or_zero, metavar="N",
        help="wait for N subscriptions first; default: 1 with --once and --times, else 0",
    )  # fmt: skip
    parser.add_argument(
        "--timeout",
        "--max-wait-time-secs",
        type=positive,
        metavar="SEC",
        help="end with 124 when they have not come within this time",
    )
    parser.add_argument(
        "--keep-alive", type=positive, metavar="SEC", help="stay for this long after the last message"
    )
    add_node_name_option(parser)
    parser.add_argument(
        *("-p", "--print"), type=count_or_zero, metavar="N", default=1,
        help="print every Nth message; 0: none",
    )  # fmt: skip


def run(options: Options) -> int:
    """Publish as the options say."""
    from actors.cli.loop import run_async
    from actors.cli.values import named_message, stamped_message_from_text

    msg_type = named_message(options.type, options)
    if options.stdin and options.values is not None:
        raise CommandError("Give VALUES or --stdin, not both", USAGE)
    stamped = None if options.stdin else stamped_message_from_text(msg_type, options.values or "{}")
    run_async(lambda: _publish(options, msg_type, stamped))
    return 0


async def _publish(options: Options, msg_type: type[Message], stamped: Stamped | None) -> None:
    import asyncio
    from contextlib import aclosing
    from functools import partial

    from actors.cli.hidden_node import graph_of, hidden_node
    from actors.cli.stdin import documents
    from actors.cli.subscriber import warn_unpublished
    from actors.cli.values import profile, stamped_message_from_text
    from actors.qos.profile import QoSProfile

    async with hidden_node(options, name=options.node_name) as node:
        snapshot = await graph_of(node)
        if options.use_sim_time:  # 'auto' and 'now' are 0 until then
            warn_unpublished(snapshot, "/clock")
        _check_type(options, snapshot, node.resolve_topic_name(options.topic), msg_type)
        publisher = node.create_publisher(msg_type, options.topic, profile(options, QoSProfile(depth=10)))
        await _wait_for_subscriptions(options, publisher)
        if not options.json:
            print_out("publisher: beginning loop")
        if stamped is None:
            coming, rate = documents(partial(stamped_message_from_text, msg_type)), options.rate
        else:
            coming, rate = _repeat(stamped), options.rate or DEFAULT_HZ
        async with aclosing(coming) as messages:
            await _publish_all(options, publisher, messages, rate, node.get_clock())
        await publisher.flush(FLUSH_TIMEOUT_SEC)
        if options.keep_alive:
            await asyncio.sleep(options.keep_alive)


async def _repeat(stamped: Stamped) -> AsyncGenerator[Stamped]:
    while True:
        yield stamped


def _wanted(options: Options) -> int:
    """Return how many subscriptions to wait for."""
    if options.wait_matching_subscriptions is not None:
        wanted: int = options.wait_matching_subscriptions
        return wanted
    return 1 if options.once or options.times else 0


def _check_type(options: Options, snapshot: GraphSnapshot, topic: str, msg_type: type[Message]) -> None:
    """Raise CommandError if it would wait for subscriptions, and the topic has another type; else warn."""
    from actors.cli.values import require_type

    for kind in (EntryKind.SUBSCRIPTION, EntryKind.PUBLISHER):
        try:
            if require_type(snapshot, kind, topic, msg_type):
                return
        except CommandError as error:
            if _wanted(options):
                raise
            if kind is EntryKind.PUBLISHER:  # the node warns of subscriptions itself
                print_err(f"WARNING: {error}")
            return


async def _wait_for_subscriptions(options: Options, publisher: Publisher[Message]) -> None:
    from actors.endpoints.endpoint import endpoint_of
    from actors.errors import WaitTimeout

    wanted = _wanted(options)
    if not wanted:
        return
    await publisher.flush()  # the broker has reported the subscriptions
    if publisher.get_subscription_count() >= wanted:
        return
    print_err(f"Waiting for at least {wanted} matching subscription(s) on {publisher.topic_name}...")
    try:
        await endpoint_of(publisher).context.wait_until(
            lambda: publisher.get_subscription_count() >= wanted, "Too few subscriptions", options.timeout
        )
    except WaitTimeout:
        found = publisher.get_subscription_count()
        raise CommandError(
            f"Only {found} of {wanted} subscription(s) on {publisher.topic_name}"
            f" within {options.timeout:g} s",
            TIMEOUT,
        ) from None


async def _publish_all(
    options: Options,
    publisher: Publisher[Message],
    messages: AsyncGenerator[Stamped],
    rate: float | None,
    clock: Clock,
) -> None:
    """Publish at the given rate, without drift, and the given number of times."""
    from actors.cli.rate_limit import RateLimit
    from actors.interfaces.convert import message_to_ordereddict

    times = 1 if options.once else options.times or None
    rate_limit = RateLimit(rate)
    number = 0
    async for message, stamps in messages:
        number += 1
        await publisher.ready(None)
        stamps.set(message, clock.now().nanoseconds)
        publisher.publish(message)
        if options.print and number % options.print == 0:
            if options.json:
                print_json({"number": number, "message": message_to_ordereddict(message)})
            else:
                print_out(f"publishing #{number}: {message!r}\n")
        if number == times:
            return
        await rate_limit.wait()
