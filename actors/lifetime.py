"""A node's life: how it starts, what ends it, and how it stops.

`begin` and `end` are what entering and leaving `async with node:` do. Everything a node runs is a task of one
group, which `end` has awaited when it returns: nothing of a node outlives it.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

from actors.diagnostics import Size
from actors.errors import NodeAlreadyRunning
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Coroutine, Iterator

    from actors.clock import Clock
    from actors.core import Core
    from actors.dialer import Dialer

STOP_TIMEOUT_SEC: Final = 5.0
"""What a stopping node gives what it has published to leave, and then the link to close. Callbacks that still
run are cancelled; one that swallows that holds the node up, which is logged."""


class Lifetime:
    """One node's.

    Args:
        core: What the node's parts share.
        clock: The node's clock, which is destroyed with it.
        dialer: Keeps the node's link.
        connect_timeout_sec: How long `begin` waits for a broker; None does not wait.
        stop_timeout_sec: What `end` gives queued messages to be sent.
    """

    def __init__(
        self,
        core: Core,
        clock: Clock,
        dialer: Dialer,
        *,
        connect_timeout_sec: float | None,
        stop_timeout_sec: float,
    ) -> None:
        self._core = core
        self._clock = clock
        self._dialer = dialer
        self._connect_timeout_sec = connect_timeout_sec
        self._stop_timeout_sec = stop_timeout_sec
        self._group: asyncio.TaskGroup | None = None
        self._tasks: dict[asyncio.Task[None], None] = {}
        self._body: asyncio.Task[Any] | None = None
        """The task that is inside `async with`."""
        self._cancelled_body: asyncio.Task[Any] | None = None
        self._done: asyncio.Event | None = None
        self._failure: Exception | None = None
        core.stop = self.fail

    async def begin(self) -> None:
        """Connect in the background, run callbacks as messages come.

        Raises:
            NodeAlreadyRunning: It runs already.
            NodeDestroyed: It has been destroyed.
            BrokerUnreachable: There was no broker within `connect_timeout_sec`.
        """
        core, link = self._core, self._core.link
        if self._group is not None:
            raise NodeAlreadyRunning(f"Node '{core.full_name}' is running already")
        core.require_alive()
        self._done = asyncio.Event()
        self._body = asyncio.current_task()
        self._group = asyncio.TaskGroup()
        await self._group.__aenter__()
        link.loop = asyncio.get_running_loop()
        self._spawn(self._keep_link())
        core.mailbox.open(self._spawn)
        for timer in core.timers:
            timer.start()
        try:
            if self._connect_timeout_sec is not None:
                while not link.connections and self._failure is None:
                    await link.changed()
        except BaseException:
            await self.end(None)
            raise

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        assert self._group is not None
        task = self._group.create_task(coroutine)
        self._tasks[task] = None
        task.add_done_callback(self._tasks.pop)
        return task

    async def _keep_link(self) -> None:
        try:
            await self._dialer.run(connect_timeout_sec=self._connect_timeout_sec)
        except CallboardError as error:
            self.fail(error)

    def sizes(self) -> Iterator[Size]:
        """Say how many tasks it holds."""
        yield Size(name="tasks", size=len(self._tasks))

    def fail(self, error: Exception) -> None:
        """End the node with an error: whoever runs it gets it raised."""
        if self._failure is None:
            self._failure = error
            self._core.link.wake()
            if self._done is not None:
                self._done.set()
            if self._body is not None:
                self._body.cancel()
                self._cancelled_body = self._body

    async def destroyed(self) -> None:
        """Wait until the node is destroyed; only while it runs."""
        assert self._done is not None
        await self._done.wait()

    async def end(self, error: BaseException | None) -> None:
        """Send what is queued, take everything back, end every task.

        Args:
            error: What ended the body; raised instead of it is the error that the node has failed with.
        """
        assert self._group is not None
        self._body = None
        try:
            await self._close()
        finally:
            for task in tuple(self._tasks):
                task.cancel()
            if self._tasks:
                _, stubborn = await asyncio.wait(self._tasks, timeout=self._stop_timeout_sec)
                if stubborn:
                    self._core.log.warning(f"{len(stubborn)} callbacks ignore that the node stops")
            group, self._group = self._group, None
            await group.__aexit__(None, None, None)
        if self._cancelled_body is not None:
            self._cancelled_body.uncancel()
        if self._failure is not None and (error is None or isinstance(error, asyncio.CancelledError)):
            raise self._failure

    async def _close(self) -> None:
        core, link = self._core, self._core.link
        core.mailbox.close()
        self._destroy_parts()
        try:
            async with asyncio.timeout(self._stop_timeout_sec):
                while link.connected and not all(lane.empty for lane in core.departing):
                    await link.changed()
        except TimeoutError:
            left = sum(max(1, lane.pending) for lane in core.departing if not lane.empty)
            core.log.warning(f"Stopping with {left} published messages unsent")
        await self._dialer.close(timeout_sec=self._stop_timeout_sec)
        core.destroyed = True
        self._clock.destroy()

    def destroy(self) -> None:
        """Take everything out of service at once and let `destroyed` return. Twice is no error."""
        core = self._core
        if core.destroyed:
            return
        self._destroy_parts()
        core.destroyed = True
        self._clock.destroy()
        core.link.wake()
        if self._done is not None:
            self._done.set()

    def _destroy_parts(self) -> None:
        for timer in tuple(self._core.timers):
            timer.destroy()
        for entity in tuple(self._core.entities):
            entity.destroy()
