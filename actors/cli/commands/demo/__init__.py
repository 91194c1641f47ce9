"""`callboard demo`: a broker and five nodes in one process, talking for a few seconds."""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import statistics
import sys
from contextlib import AsyncExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.interrupts import Interrupted
from actors.cli.output import print_out
from actors.cli.parsing import Options, Parser, positive
from actors.cli.web_address import DEFAULT_LISTEN, check_web
from actors.config import environment
from actors.logging.severity import ROOT_NAME
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.cli.commands.demo.nodes import (
        AddTwoIntsClient,
        AddTwoIntsServer,
        MinimalPublisher,
        MinimalSubscriber,
        PublishingSubscriber,
    )
    from broker import BrokerOptions

TALK_SEC: Final = 6.3
"""Not a multiple of the nodes' periods, so that no message is in flight when it ends."""
_COLORS: Final = {
    "add_two_ints_server": 35,
    "add_two_ints_client": 33,
    "minimal_publisher": 32,
    "minimal_subscriber": 36,
    "publishing_subscriber": 34,
}
_WIDTH: Final = max(map(len, _COLORS))


EXAMPLES: Final = {
    "callboard demo": "a broker and five nodes, for a few seconds",
    "callboard demo --web": "the same with the page, until Ctrl-C",
}


def add_arguments(parser: Parser) -> None:
    """Describe the verb."""
    parser.add_argument(
        "--seconds",
        type=positive,
        metavar="SEC",
        help=f"how long to talk; default: {TALK_SEC:g}, or until Ctrl-C with --web",
    )
    parser.add_flag("--web", help="also serve the page, with control")


def run(options: Options) -> int:
    """Run the nodes, and print a summary, also after a signal."""
    if options.web:
        check_web(DEFAULT_LISTEN, "--web")
    seconds = options.seconds or (math.inf if options.web else TALK_SEC)
    cast: list[DemoNodes] = []
    with _labelled_log() as lines, suppress(Interrupted, asyncio.CancelledError):
        from actors.cli.loop import run_async

        run_async(lambda: _talk(seconds, cast, lines, web=options.web))
    print_out(_summary(cast[0] if cast else None))
    return 0


class DemoNodes(NamedTuple):
    """The demo's nodes."""

    server: AddTwoIntsServer
    client: AddTwoIntsClient
    publisher: MinimalPublisher
    subscriber: MinimalSubscriber
    repeater: PublishingSubscriber


async def _talk(seconds: float, cast: list[DemoNodes], lines: _Lines, *, web: bool) -> None:
    """Run the broker and the nodes for a while; adds the nodes to `cast` for the summary."""
    from actors.cli.commands.demo import nodes as demo_nodes
    from broker import Broker

    task = asyncio.current_task()
    assert task is not None
    lines.on_closed = task.cancel
    async with AsyncExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory(prefix="callboard-demo-"))
        broker = await stack.enter_async_context(Broker(_options(folder)))
        time = "" if seconds == math.inf else f" for {seconds:.0f} s"
        print_out(f"A broker at {broker.url}, and five nodes that talk{time}. Ctrl-C ends it.\n")
        if web:
            from actors.cli.beside import web_beside

            await stack.enter_async_context(web_beside(broker.url, DEFAULT_LISTEN, "--allow-control"))
        nodes = DemoNodes(
            demo_nodes.AddTwoIntsServer(broker.url),
            demo_nodes.AddTwoIntsClient(broker.url),
            demo_nodes.MinimalPublisher(broker.url),
            demo_nodes.MinimalSubscriber(broker.url),
            demo_nodes.PublishingSubscriber(broker.url),
        )
        cast.append(nodes)
        for node in nodes:
            await stack.enter_async_context(node)
        with suppress(TimeoutError):
            async with asyncio.timeout(None if seconds == math.inf else seconds):
                await nodes.client.ask_again_and_again()


def _options(folder: str) -> BrokerOptions:
    """Return a broker's options: a free port, or a unix socket where even the loopback device is down."""
    from broker import BrokerOptions

    try:
        with socket.create_server(("127.0.0.1", 0)) as server:
            socket.create_connection(server.getsockname(), timeout=1.0).close()
    except OSError:
        return BrokerOptions(unix=Path(folder) / "broker.sock")
    return BrokerOptions(port=0)


def _summary(cast: DemoNodes | None) -> str:
    if cast is None:
        return "\nStopped before anything was said."
    sent = cast.publisher.publisher.published + cast.repeater.publisher.published
    heard = cast.subscriber.subscription.received + cast.repeater.subscription.received
    calls = cast.client.call_seconds
    p50 = f", p50 {1000 * statistics.median(calls):.2f} ms" if calls else ""
    return f"\n{sent} messages sent, {heard} heard; {len(calls)} service calls{p50}."


class _Labels(logging.Formatter):
    """A node's name, in the node's colour, before each of its lines."""

    def __init__(self, *, color: bool) -> None:
        super().__init__()
        self._color = color

    def format(self, record: logging.LogRecord) -> str:
        """Return the line or lines."""
        name = record.name.removeprefix(ROOT_NAME + ".")
        text = record.getMessage()
        if record.levelno >= logging.WARNING:
            text = f"{record.levelname}: {text}"
        if record.exc_info:
            text = f"{text}\n{self.formatException(record.exc_info)}"
        start = f"\x1b[{_COLORS.get(name, 31)}m" if self._color else ""
        end = "\x1b[0m" if self._color else ""
        return "\n".join(f"{start}{name:<{_WIDTH}} | {line}{end}" for line in sanitize(text).splitlines())


class _Lines(logging.StreamHandler[Any]):
    """Writes to stdout; if that is closed, the demo ends instead of reporting an error per line."""

    on_closed: Callable[[], object] | None = None

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's name
        """End the demo if stdout is closed."""
        if isinstance(sys.exception(), OSError) and self.on_closed is not None:
            self.on_closed()
        else:
            super().handleError(record)


@contextmanager
def _labelled_log() -> Generator[_Lines]:
    """Send the nodes' log lines to stdout under their labels."""
    log = logging.getLogger(ROOT_NAME)
    handler = _Lines(sys.stdout)
    wish = environment.color_wish()
    handler.setFormatter(_Labels(color=sys.stdout.isatty() if wish is None else wish))
    level, propagate = log.level, log.propagate
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
    try:
        yield handler
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
        log.propagate = propagate
