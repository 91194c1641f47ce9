"""Runs the live view: the screen in one thread, the node that reads the graph in another."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING, Final

from actors.cli.broker_target import target_of
from actors.cli.commands.top.app import TopApp
from actors.cli.commands.top.source import NodeSource
from actors.cli.errors import FAILURE, OK
from actors.cli.hidden_node import hidden_node
from actors.cli.interrupts import raise_at_once
from actors.cli.loop import run_async
from actors.logging.severity import LoggingSeverity
from actors.threads.node_thread import NodeThread

if TYPE_CHECKING:
    import argparse

SWITCH_INTERVAL_S: Final = 0.0005
"""Longest time that the screen's thread keeps the GIL: the node's thread measures delays."""


def run(options: argparse.Namespace) -> int:
    """Run the live view until the user quits; return the exit code.

    Raises:
        BrokerUnreachable: No broker answers within 2 s.
        Exception: The error with which the node failed.
    """
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    target = target_of(options)
    shown = ", ".join(map(str, target.urls)) + (f" domain {target.domain}" if target.domain else "")
    raise_at_once()
    with NodeThread("callboard-node") as thread:
        node = thread.enter(hidden_node(options))
        node.get_logger().set_level(LoggingSeverity.FATAL)  # the live view covers the terminal
        source = NodeSource(thread, node, shown)
        return run_async(lambda: _show(options, source, thread))


async def _show(options: argparse.Namespace, source: NodeSource, thread: NodeThread) -> int:
    app = TopApp(source, interval_s=options.interval, words=options.filter, hidden=options.include_hidden)

    def stop(ended: asyncio.Future[None]) -> None:
        if not ended.cancelled():
            ended.exception()  # raised by the end of the thread
            app.exit()

    ended = asyncio.wrap_future(thread.ended)
    ended.add_done_callback(stop)
    await app.run_async()
    ended.cancel()
    task = asyncio.current_task()
    if task is not None and task.cancelling():  # the app ends without an error when it is cancelled
        raise asyncio.CancelledError
    return FAILURE if app.return_code else OK
