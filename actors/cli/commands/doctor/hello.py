"""`callboard doctor hello`: publish, and count the messages of the other hosts that do the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, positive

if TYPE_CHECKING:
    from collections import Counter

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.interfaces.std_msgs.msg import String

EXAMPLES: Final = {
    "callboard doctor hello": "on two hosts with one broker: how many messages of the other host arrive",
    "callboard doctor hello --once": "one message, and what has arrived after the emit period",
}
EMIT_SEC: Final = 0.1
PRINT_SEC: Final = 1.0
MAX_HOSTS: Final = 100
"""Hosts that are counted by name; a host can send any name."""
OTHERS: Final = "(others)"


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        *("-t", "--topic"), metavar="TOPIC", nargs="?", const="/canyouhearme", default="/canyouhearme",
        help="the topic to publish on; default: /canyouhearme",
    )  # fmt: skip
    parser.add_argument(
        *("-ep", "--emit-period"), type=positive, metavar="SEC", default=EMIT_SEC,
        help=f"the time between two messages; default: {EMIT_SEC:g}",
    )  # fmt: skip
    parser.add_argument(
        *("-pp", "--print-period"), type=positive, metavar="SEC", default=PRINT_SEC,
        help=f"the time between two tables; default: {PRINT_SEC:g}",
    )  # fmt: skip
    parser.add_argument(
        "--ttl", type=positive, metavar="N", help="accepted for ROS 2's sake: nothing uses multicast"
    )
    parser.add_flag(
        "-1", "--once", help="publish once, print what has arrived after the emit period, and end"
    )
    add_json_option(parser, "one document a period: topic, published, hosts")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Publish and print a table once a period, until a signal or --once ends it."""
    from actors.cli.loop import run_async

    run_async(lambda: _greet(options))
    return 0


async def _greet(options: Options) -> None:
    import asyncio
    import socket
    from collections import Counter

    from actors.cli.hidden_node import hidden_node
    from actors.cli.rate_limit import RateLimit
    from actors.interfaces.std_msgs.msg import String

    hosts: Counter[str] = Counter()
    greeting = String(data=f"hello, it's me {socket.gethostname()}")
    async with hidden_node(options) as node:
        publisher = node.create_publisher(String, options.topic, 10)

        def count(message: String, info: MessageInfo) -> None:
            if info.publisher_gid != publisher.gid:
                host = (message.data.split() or [""])[-1]
                hosts[host if host in hosts or len(hosts) < MAX_HOSTS else OTHERS] += 1

        node.create_subscription(String, publisher.topic_name, count, 100)
        await publisher.flush()  # both are declared
        clock = asyncio.get_running_loop().time
        rate_limit, due, published = RateLimit(1 / options.emit_period), clock() + options.print_period, 0
        while True:
            publisher.publish(greeting)
            published += 1
            await rate_limit.wait()
            if options.once or clock() >= due:
                _print(options, publisher.topic_name, published, hosts)
                hosts.clear()
                published, due = 0, clock() + options.print_period
            if options.once:
                return


def _print(options: Options, topic: str, published: int, hosts: Counter[str]) -> None:
    """Print ROS 2's table, without what it says of multicast."""
    from actors.cli.output import print_json, print_out

    if options.json:
        found = [{"host": host, "messages": number} for host, number in hosts.items()]
        print_json({"topic": topic, "published": published, "hosts": found})
        return
    rows = [("Hostname", f"Msg Count /{options.print_period}s"), *hosts.items()]
    print_out("MULTIMACHINE COMMUNICATION SUMMARY")
    print_out(f"Topic: {topic}, Published Msg Count: {published}")
    print_out("Subscribed from:")
    for host, number in rows:
        print_out(f"{'':<15} {host:<20} {number:<10}".replace("\n", "\\n"))
    print_out("-" * 60)
