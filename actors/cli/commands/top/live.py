"""Runs the live view on a broker: the screen in one thread, the node that looks in another."""

from __future__ import annotations

import asyncio
import sys
import threading
from concurrent.futures import Future
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
"""How long the screen's thread may keep the other one waiting: delays are measured there."""


def run(options: argparse.Namespace) -> int:
    """Show what goes on until somebody quits; return the exit code."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return run_async(lambda: _show(options))


async def _show(options: argparse.Namespace) -> int:
    async with NodeThread(options) as source:
        app = TopApp(source, interval_s=options.interval, words=options.filter, hidden=options.include_hidden)
        await app.run_async()
        task = asyncio.current_task()
        if task is not None and task.cancelling():  # the screen has ended in good order for it
            raise asyncio.CancelledError
        return FAILURE if app.return_code else OK


class NodeThread:
    """The command's hidden node, on a loop and in a thread of its own. Enter it to get its source.

    Raises (on entry):
        BrokerUnreachable: No broker within 2 s.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._ready: Future[tuple[NodeSource, asyncio.AbstractEventLoop, asyncio.Event]] = Future()
        self._thread = threading.Thread(target=self._run, name="callboard-node", daemon=True)

    async def __aenter__(self) -> NodeSource:
        """Start the thread and wait for the node's link."""
        self._thread.start()
        source, self._loop, self._stop = await asyncio.wrap_future(self._ready)
        return source

    async def __aexit__(self, *error: object) -> None:
        """Let the node leave, and wait for that."""
        self._loop.call_soon_threadsafe(self._stop.set)
        await asyncio.to_thread(self._thread.join)

    def _run(self) -> None:
        try:
            asyncio.run(self._stay())
        except BaseException as error:  # noqa: BLE001 - raised where it is waited for
            if not self._ready.done():
                self._ready.set_exception(error)

    async def _stay(self) -> None:
        target = target_of(self._options)
        shown = ", ".join(map(str, target.urls)) + (f" domain {target.domain}" if target.domain else "")
        async with hidden_node(self._options) as node:
            node.get_logger().set_level(LoggingSeverity.FATAL)  # the screen is taken, and has a banner
            stop = asyncio.Event()
            self._ready.set_result((NodeSource(node, shown), asyncio.get_running_loop(), stop))
            await stop.wait()
