"""Runs the callbacks of a node as tasks of an asyncio loop, in the place of an executor."""

from __future__ import annotations

import asyncio
import inspect
from contextlib import suppress
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any, Final

from actors.ros.rclpy.timer import Timer

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.ros.rclpy.entity import Entity
    from actors.ros.rclpy.node_parts import NodeParts

MAX_CONCURRENT: Final = 1000
"""Callbacks of one concurrent entity that run at the same time; further messages wait in its queue, whose
depth bounds them. As many as requests that a service of callboard handles at once."""


class LoopDispatcher:
    """Runs the callbacks of the entities of one node, those of one entity one after another.

    Args:
        parts: The node's parts.
        group: Its tasks end with this group, and an error of a callback ends the group.
        on_end: Called in the loop when the context has ended.

    Attributes:
        work: This object: it is its own queue.
        group: The group.
        ended: Set when the node has been destroyed.
    """

    def __init__(self, parts: NodeParts, group: asyncio.TaskGroup, on_end: Callable[[], object]) -> None:
        self.work = self
        self._parts = parts
        self.group = group
        self.ended = asyncio.Event()
        self._on_end = on_end
        self._loop = asyncio.get_running_loop()
        self._tasks: dict[Entity, set[asyncio.Task[None]]] = {}
        self._others: set[asyncio.Task[None]] = set()
        """Of `create_task`."""
        self._alarm: asyncio.TimerHandle | None = None
        """Set for the timer that is due next."""
        self._stopped = False

    def start(self) -> None:
        """Run what has arrived before, and look at the timers."""
        self.wake()  # the context may have ended before it knew of this
        for entity in self._parts.all_entities():
            if entity.has_work():
                self.add(entity)
        self._set_alarm()

    def stop(self) -> None:
        """Cancel all callbacks and begin no others; in any thread."""
        self._stopped = True
        self._post(self._cancel_all)

    def _cancel_all(self) -> None:
        if self._alarm is not None:
            self._alarm.cancel()
        for entity in tuple(self._tasks):
            self._cancel(entity)
        for task in self._others:
            task.cancel()

    def end(self) -> None:
        """Set `ended`: the node has been left; in any thread."""
        self._post(self.ended.set)

    def cancel(self, entity: Entity) -> None:
        """Cancel the callbacks of an entity; in any thread."""
        self._post(self._cancel, entity)

    def _cancel(self, entity: Entity) -> None:
        for task in self._tasks.pop(entity, ()):
            task.cancel()

    def wake(self) -> None:
        """Look whether the context has ended; in any thread, and in signal handlers."""
        if not self._parts.context.ok():
            self._post(self._on_end)

    def _post(self, callback: Callable[..., object], *args: Any) -> None:
        with suppress(RuntimeError):  # the loop is closed, and so are its tasks
            self._loop.call_soon_threadsafe(callback, *args)

    # What entities, futures and tasks use of an executor and its queue

    def add(self, entity: Entity) -> None:
        """Run work of an entity soon; in any thread."""
        entity.queued_in = self
        self._post(self._begin, entity)

    def timers_changed(self) -> None:
        """Look again at when timers are due; in any thread."""
        self._post(self._set_alarm)

    def create_task(self, callback: Callable[..., Any], *args: Any) -> None:
        """Run a function, or a coroutine function, in the loop; in any thread."""
        self._post(self._begin_other, partial(callback, *args))

    # In the loop

    def _begin(self, entity: Entity) -> None:
        entity.queued_in = None
        if self._stopped:
            return
        tasks = self._tasks.setdefault(entity, set())
        if not getattr(entity, "concurrent", False):
            if not tasks:
                self._create_task(entity, tasks, self._run_all(entity))
            return
        while len(tasks) < MAX_CONCURRENT and (call := entity.take()) is not None:
            self._create_task(entity, tasks, _run(call))
        if not tasks:  # there was no work, and it may have been destroyed
            del self._tasks[entity]

    def _create_task(
        self, entity: Entity, tasks: set[asyncio.Task[None]], work: Coroutine[Any, Any, None]
    ) -> None:
        task = self.group.create_task(work)
        tasks.add(task)
        task.add_done_callback(partial(self._task_ended, entity, tasks))

    def _begin_other(self, call: Callable[[], Any]) -> None:
        if self._stopped:
            return
        task = self.group.create_task(_run(call))
        self._others.add(task)
        task.add_done_callback(self._others.discard)

    async def _run_all(self, entity: Entity) -> None:
        while (call := entity.take()) is not None:
            await _run(call)
            await asyncio.sleep(0)  # others get their turn, also between callbacks that never wait

    def _task_ended(self, entity: Entity, tasks: set[asyncio.Task[None]], task: asyncio.Task[None]) -> None:
        tasks.discard(task)
        if self._stopped or self._tasks.get(entity) is not tasks:
            return
        if entity.has_work():  # it has come since `take` returned nothing
            self._begin(entity)
        elif not tasks:
            del self._tasks[entity]
            if isinstance(entity, Timer):
                self._set_alarm()

    def _set_alarm(self) -> None:
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
        idle = [each for each in self._timers() if each not in self._tasks]
        rest = min((each.remaining_sec() for each in idle), default=inf)
        if rest < inf and not self._stopped:
            self._alarm = self._loop.call_later(max(0.0, rest), self._run_due)

    def _run_due(self) -> None:
        for timer in self._timers():
            if timer.remaining_sec() <= 0:
                self._begin(timer)
        self._set_alarm()

    def _timers(self) -> list[Timer]:
        return [each for each in self._parts.all_entities() if isinstance(each, Timer)]


async def _run(call: Callable[[], Any]) -> None:
    result = call()
    if inspect.isawaitable(result):
        await result
