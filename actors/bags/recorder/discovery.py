"""Follows the graph, so that topics are recorded as they appear; this can be stopped, and started again."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Collection

    from actors.bags.supervised_tasks import SupervisedTasks
    from actors.graph.snapshot import GraphSnapshot
    from actors.node.node import Node


class Discovery:
    """Reports the topics that are there, and those that appear.

    Args:
        node: The recorder's node.
        tasks: Runs the task that follows the graph.
        look: Called with the graph, and the names of the topics that have changed.
    """

    def __init__(
        self,
        node: Node,
        tasks: SupervisedTasks,
        look: Callable[[GraphSnapshot, Collection[str]], Awaitable[None]],
    ) -> None:
        self._node = node
        self._tasks = tasks
        self._look = look
        self._task: asyncio.Task[None] | None = None

    @property
    def is_running(self) -> bool:
        """Whether topics that appear are reported."""
        return self._task is not None and not self._task.done()

    async def begin(self, *, once: bool) -> None:
        """Start, and wait until the topics that are there are recorded, if there is a broker.

        Args:
            once: Whether to report only these.
        """
        looked: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._task = self._tasks.start(self._follow(looked, once=once))
        if self._node.connected:
            await looked

    def start(self) -> bool:
        """Report topics that appear from now on, and those that have appeared since `stop`.

        Returns:
            False if it runs already.
        """
        if self.is_running:
            return False
        self._task = self._tasks.start(self._follow(None, once=False))
        return True

    def stop(self) -> bool:
        """Report no topics that appear from now on.

        Returns:
            False if it does not run.
        """
        if self._task is None or not self.is_running:
            return False
        self._task.cancel()
        self._task = None
        return True

    async def _follow(self, looked: asyncio.Future[None] | None, *, once: bool) -> None:
        watch = self._node.watch_graph()
        try:
            async for changes in watch.batches():
                names = {each.name for each in changes if each.name}
                await self._look(watch.snapshot, names)
                if looked is not None and not looked.done():
                    # The answer comes after the subscriptions are declared, so publishers match from here on.
                    await self._node.get_graph()
                    looked.set_result(None)
                if once:
                    break
        except BaseException as error:
            if looked is not None and not looked.done():
                looked.set_exception(error)
            raise
        finally:
            watch.destroy()
