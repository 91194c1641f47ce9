"""Runs the live view: the screen in one thread, the node that reads the graph in another."""

from __future__ import annotations

import asyncio
import sys
import threading
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.cli.broker_target import target_of
from actors.cli.commands.top.app import TopApp
from actors.cli.commands.top.source import NodeSource
from actors.cli.errors import FAILURE, OK
from actors.cli.hidden_node import hidden_node
from actors.cli.loop import run_async
from actors.logging.logger import LoggingSeverity

if TYPE_CHECKING:
    import argparse

SWITCH_INTERVAL_S: Final = 0.0005
"""Longest time that the screen's thread keeps the GIL: the node's thread measures delays."""


def run(options: argparse.Namespace) -> int:
    """Run the live view until the user quits; return the exit code."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return run_async(lambda: _show(options))


async def _show(options: argparse.Namespace) -> int:
    thread = NodeThread(options)
    async with thread as source:
        app = TopApp(source, interval_s=options.interval, words=options.filter, hidden=options.include_hidden)

        def stop(_: object) -> None:
            app.exit()

        thread.ended.add_done_callback(stop)
        await app.run_async()
        thread.ended.remove_done_callback(stop)
        task = asyncio.current_task()
        if task is not None and task.cancelling():  # the app ends without an error when it is cancelled
            raise asyncio.CancelledError
        return FAILURE if app.return_code else OK


class NodeThread:
    """The command's hidden node, on an event loop and in a thread of its own. Enter it to get its source.

    Attributes:
        ended: A future, once entered: done when the thread ends, with the node's error if it failed.

    Raises (on entry):
        BrokerUnreachable: No broker answers within 2 s.

    Raises (on exit):
        Exception: The error with which the node failed.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._ready: Future[tuple[NodeSource, asyncio.AbstractEventLoop, asyncio.Event]] = Future()
        self._ended: Future[None] = Future()
        self._thread = threading.Thread(target=self._run, name="callboard-node", daemon=True)

    async def __aenter__(self) -> NodeSource:
        """Start the thread and wait until the node is connected."""
        self._thread.start()
        source, self._loop, self._stop = await asyncio.wrap_future(self._ready)
        self.ended = asyncio.wrap_future(self._ended)
        return source

    async def __aexit__(self, *error: object) -> None:
        """Stop the node and wait until its thread ends."""
        with suppress(RuntimeError):  # the node has failed, and its loop is closed
            self._loop.call_soon_threadsafe(self._stop.set)
        await asyncio.to_thread(self._thread.join)
        await self.ended

    def _run(self) -> None:
        try:
            asyncio.run(self._stay())
        except BaseException as error:  # noqa: BLE001 - raised where it is waited for
            (self._ended if self._ready.done() else self._ready).set_exception(error)
        else:
            self._ended.set_result(None)

    async def _stay(self) -> None:
        target = target_of(self._options)
        shown = ", ".join(map(str, target.urls)) + (f" domain {target.domain}" if target.domain else "")
        async with hidden_node(self._options) as node:
            node.get_logger().set_level(LoggingSeverity.FATAL)  # the live view covers the terminal
            stop = asyncio.Event()
            self._ready.set_result((NodeSource(node, shown), asyncio.get_running_loop(), stop))
            await stop.wait()
