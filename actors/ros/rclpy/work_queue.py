"""The work of an executor: entities with callbacks to run, tasks to resume, and the wait for both.

An entity enters the queue when it has work, in any thread, and is in it once. The executor takes one piece of
work of the first entity; if the entity has more, it goes to the end, so that all get their turn.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

from actors.ros.rclpy.executor_errors import (
    ConditionReachedException,
    TimeoutException,
)
from actors.ros.rclpy.entity import Entity, EntityExecutor
from actors.ros.rclpy.task import Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.task import Future

Work: TypeAlias = "tuple[Callable[[], Any], Entity] | Task[Any]"
"""A call of a callback with the entity that has the callback; or a task."""


POLL_SEC: Final = 0.001
"""How often a coroutine that awaits something other than a `Future` is resumed, until that is there."""


class WakeUp:
    """Wakes one waiting thread. `set` may be called anywhere, in signal handlers, too: it never waits."""

    def __init__(self) -> None:
        # A lock as a flag: locked means that nobody has called `set`. An Event or a Condition takes a lock
        # of its own to be set, and a signal handler that interrupts that code would wait for it for ever.
        self._lock = threading.Lock()
        self._lock.acquire()

    def set(self) -> None:
        """End the wait in progress, or else the next one."""
        try:  # noqa: SIM105 - `suppress` takes longer, and each message may come here
            self._lock.release()
        except RuntimeError:  # it is set already
            pass

    def wait(self, timeout_sec: float) -> None:
        """Wait until it is set, and unset it."""
        self._lock.acquire(timeout=-1 if timeout_sec == inf else min(timeout_sec, threading.TIMEOUT_MAX))


class DueTimer(Protocol):
    """The part of a timer that the queue uses."""

    def remaining_sec(self) -> float:
        """Return the seconds until it is due."""
        ...

    def notify(self) -> None:
        """Enter the queue."""
        ...


class TimersNode(Protocol):
    """The part of a node that the queue uses."""

    @property
    def timers(self) -> Iterable[DueTimer]:
        """The timers."""
        ...


class WorkOwner(EntityExecutor, Protocol):
    """The part of an executor that its queue uses."""

    @property
    def context(self) -> Context:
        """The context."""
        ...

    @property
    def is_shut_down(self) -> bool:
        """Whether it runs no further callbacks."""
        ...

    def end_error(self) -> BaseException:
        """Return the exception for waits after its end, or its context's."""
        ...

    def has_capacity(self) -> bool:
        """Return whether another piece of work can be run now."""
        ...

    def get_nodes(self) -> Sequence[TimersNode]:
        """Return the nodes."""
        ...


class WorkQueue:
    """The entities with work and the tasks of one executor, and the wait for them.

    Args:
        executor: The executor.
    """

    def __init__(self, executor: WorkOwner) -> None:
        self._executor = executor
        self._ready: deque[Entity | Task[Any]] = deque()
        self._blocked: deque[Entity] = deque()
        """Entities whose callback group has refused them; they count as queued."""
        self._polled: deque[Task[Any]] = deque()
        """Tasks that await something other than a `Future`."""
        self._next_poll_sec = inf
        """The time at which `_polled` tasks are resumed, by the steady clock."""
        self._suspended: set[Task[Any]] = set()
        """Tasks that await a `Future`. The queue keeps them alive: there may be no other reference."""
        self._wake_up = WakeUp()
        """For one of the threads that wait: the one that holds `_claim`."""
        self._claim = threading.Lock()
        self._last_claimant = 0
        """The thread that held it last."""
        self._others: tuple[WakeUp, ...] = ()
        """Wake-ups of the other threads that wait. Replaced, never changed: a signal handler reads it."""
        self._others_lock = threading.RLock()
        self._next_timer_sec = inf
        """The time at which the next timer is due, by the steady clock."""
        self._timers_changed = True

    def add(self, entity: Entity) -> None:
        """Run work of an entity soon; in any thread."""
        # Before it is appended: the executor may reach it at once, and clears this when it does.
        entity.queued_in = self
        self._ready.append(entity)
        self._wake_up.set()
        # Nearly always false: one thread spins, and then each message costs one `set`.
        if self._others:
            self.wake()

    def add_task(self, task: Task[Any]) -> None:
        """Run or resume a task soon; in any thread."""
        self._suspended.discard(task)
        self._ready.append(task)
        self.wake()

    def resume_later(self, task: Task[Any], awaited: Future[Any] | None) -> None:
        """Resume a task when the future that it awaits is done; None: it awaits something else."""
        if awaited is None:
            self._polled.append(task)  # first: `_next_work` resets the time before it moves the tasks
            self._next_poll_sec = min(self._next_poll_sec, time.monotonic() + POLL_SEC)
            self.wake()
        else:
            # First: the future may be done already, and then `when_done` queues the task at once.
            self._suspended.add(task)
            awaited.when_done(lambda: self.add_task(task))
            if task.done():  # cancelled just now
                self.forget(task)

    def forget(self, task: Task[Any]) -> None:
        """Forget a task that awaits a future: it was cancelled."""
        self._suspended.discard(task)

    def wake(self) -> None:
        """Let all threads that wait look for work again."""
        self._wake_up.set()
        for each in self._others:
            each.set()

    def timers_changed(self) -> None:
        """Look again at when timers are due."""
        self._timers_changed = True
        self.wake()

    def wait(self, timeout_sec: float | None, condition: Callable[[], bool]) -> Work:
        """Return the next work; wait for it.

        Args:
            timeout_sec: Seconds to wait; None or negative for no limit.
            condition: The wait ends when it holds; code that makes it true calls `wake`.

        Raises:
            TimeoutException: There was none within `timeout_sec`.
            ConditionReachedException: There is none, and the condition holds.
            ShutdownException, ExternalShutdownException: The executor, or the context, has been shut down.
        """
        limited = timeout_sec is not None and timeout_sec >= 0
        deadline = time.monotonic() + timeout_sec if limited and timeout_sec is not None else inf
        wake_up: WakeUp | None = None
        has_polled = False
        try:
            while True:
                work = self._next_work()
                if work is not None:
                    return work
                if condition():
                    raise ConditionReachedException
                now = time.monotonic()
                if now >= deadline:
                    # As in rclpy, the shortest wait resumes these tasks, too: programs call `spin_once(0)`.
                    if has_polled or not self._polled:
                        raise TimeoutException
                    has_polled, self._next_poll_sec = True, now
                    continue
                # Only a thread that finds nothing claims one. With work in the queue none of this is
                # touched.
                if wake_up is None:
                    wake_up, is_current = self._claim_wake_up()
                    if not is_current:
                        continue
                until = min(deadline, self._next_timer_sec, self._next_poll_sec)
                wake_up.wait(max(0.0, until - now))
        finally:
            if wake_up is not None:
                self._release_wake_up(wake_up)

    def _next_work(self) -> Work | None:
        executor = self._executor
        # Before any work: after a shutdown no further callback begins, even if there is some in the queue.
        if executor.is_shut_down or not executor.context.ok():
            raise executor.end_error()
        if self._next_poll_sec < inf and time.monotonic() >= self._next_poll_sec:
            self._next_poll_sec = inf  # before they are moved: another thread may add one meanwhile
            _move_all(self._polled, self._ready)
        # Every time: a callback that has ended wakes this queue, and their groups may accept them now.
        if self._blocked:
            _move_all(self._blocked, self._ready)
        if self._timers_changed or time.monotonic() >= self._next_timer_sec:
            self._add_timers()
        # Without a free thread the work stays where it is, so that a message waits in its subscription,
        # whose depth limits how many do.
        return self._pop() if executor.has_capacity() else None

    def _claim_wake_up(self) -> tuple[WakeUp, bool]:
        """Return what `wake` sets for this thread from now on, and whether it can wait on it at once.

        It can if it was the last thread that waited on it: what has come since then has set it. Otherwise
        another thread may have been woken for what came after this one looked for work.
        """
        if self._claim.acquire(blocking=False):
            former, self._last_claimant = self._last_claimant, threading.get_ident()
            return self._wake_up, former == self._last_claimant
        wake_up = WakeUp()
        with self._others_lock:
            self._others = (*self._others, wake_up)
        return wake_up, False

    def _release_wake_up(self, wake_up: WakeUp) -> None:
        if wake_up is self._wake_up:
            self._claim.release()
            return
        with self._others_lock:
            self._others = tuple(each for each in self._others if each is not wake_up)

    def _add_timers(self) -> None:
        self._timers_changed = False  # before they are looked at: one may change meanwhile
        soonest = inf
        for node in self._executor.get_nodes():
            for timer in tuple(node.timers):
                rest = timer.remaining_sec()
                if rest <= 0:
                    timer.notify()
                else:
                    soonest = min(soonest, rest)
        self._next_timer_sec = time.monotonic() + soonest

    def _pop(self) -> Work | None:
        """Remove and return work of the first entity that may run."""
        while self._ready:
            item = self._ready.popleft()
            if isinstance(item, Task):
                return item
            if item.queued_in is self:
                item.queued_in = None
            # Its node has been removed, or has another executor. The executor that adds the node again looks
            # at all its entities.
            if item.active_executor is not self._executor:
                continue
            if not self._try_begin(item):
                continue
            call = item.take()
            # At the end, behind all others with work: each entity gets one callback a round.
            if item.has_work() and item.queued_in is None:
                item.queued_in = self  # no wake-up: the thread that gets this work looks here again
                self._ready.append(item)
            if call is not None:
                return call, item
            # The callback group has been told that something begins.
            self.ended(item)
        return None

    def _try_begin(self, entity: Entity) -> bool:
        """Return whether the callback group lets the entity begin; if not, keep it for the next wake-up."""
        group = entity.callback_group
        if group.can_execute(entity) and group.beginning_execution(entity):
            return True
        entity.queued_in = self
        self._blocked.append(entity)
        # After it is in `_blocked`: the group wakes this queue as soon as it is registered, and must then
        # be found here.
        group.refused_in.add(self)
        if group.can_execute(entity):  # another thread's callback has ended before the group knew of this
            self.wake()
        return False

    def ended(self, entity: Entity) -> None:
        """Let the callback group of an entity run its other callbacks, in other executors, too."""
        group = entity.callback_group
        # Before the wake-ups, or the threads that wake would be refused once more.
        group.ending_execution(entity)
        while group.refused_in:
            with suppress(KeyError):  # another thread has taken it
                group.refused_in.pop().wake()


def _move_all(source: deque[Any], target: deque[Any]) -> None:
    """Move what is there now; other threads may append to both meanwhile, and take from both."""
    with suppress(IndexError):  # empty
        for _ in range(len(source)):
            target.append(source.popleft())
