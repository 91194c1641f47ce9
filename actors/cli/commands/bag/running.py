"""Runs the recorder of `bag record` and the player of `bag play`."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any, TypeVar

# Reading arguments needs nothing else.

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from actors.bags.player.player import Player
    from actors.bags.recorder.recorder import Recorder
    from actors.cli.parsing import Options

T = TypeVar("T", "Recorder", "Player")


@asynccontextmanager
async def running(
    options: Options, make: Callable[..., T], print_summary: Callable[[T], object]
) -> AsyncGenerator[T]:
    """Run a recorder or a player on the broker that the options choose.

    Args:
        options: The command line.
        make: Makes it from the options of its node.
        print_summary: Called when it has ended, however it ended, so that an interrupted recording, too, says
            what is in the bag. Not called if it could not start.

    Raises:
        BrokerUnreachable, ProtocolError: As `connected`.
        BagError: The bag cannot be opened, or no longer be read or written.
    """
    from actors.cli.broker_target import CONNECT_TIMEOUT_SEC, connected, target_of
    from actors.logging.output import configure_logging
    from actors.logging.severity import severity_from_name
    from proto.aio import process

    if options.own_process:
        configure_logging(severity_from_name(options.log_level or "info"))
    target = target_of(options)
    keywords: dict[str, Any] = {"node_name": options.node_name} if options.node_name else {}
    made = make(url=target.url, domain=target.domain, connect_timeout_sec=CONNECT_TIMEOUT_SEC, **keywords)
    has_started = False
    try:
        async with connected(made, target):
            has_started = True
            if options.own_process:
                # Otherwise each image would return its pages to the system, and the next request them again.
                process.configure_process()
            yield made
    finally:
        if has_started:
            print_summary(made)
