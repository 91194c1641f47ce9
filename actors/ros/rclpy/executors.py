"""Executors run the callbacks of nodes in the threads that spin. `work_queue.py` has their work."""

from __future__ import annotations

import inspect
import os
import threading
import time
import warnings
import weakref
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from math import inf
from typing import TYPE_CHECKING, Any, Literal, Self, cast

from actors.ros.rclpy.executor_errors import ConditionReachedException as ConditionReachedException
from actors.ros.rclpy.executor_errors import ExternalShutdownException as ExternalShutdownException
from actors.ros.rclpy.executor_errors import ShutdownException as ShutdownException
from actors.ros.rclpy.executor_errors import TimeoutException as TimeoutException
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.context import park_at_exit
from actors.ros.rclpy.exceptions import InvalidHandle
from actors.ros.rclpy.task import Future, Task
from actors.ros.rclpy.utilities import get_default_context
from actors.ros.rclpy.work_queue import WorkQueue
from actors.ros.rclpy.node_parts import parts_of
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable
    from types import TracebackType

    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.entity import Entity
    from actors.ros.rclpy.node import Node
    from actors.ros.rclpy.node_parts import NodeParts
    from actors.ros.rclpy.work_queue import Work

__getattr__ = imported_names(
    __name__,
    "Client Clock ClockType Context Future GuardCondition InvalidHandle NumberOfEntities "
    "Service Subscription Timer TimerInfo Waitable timeout_sec_to_nsec",
)


async def await_or_execute(callback: Callable[..., Any] | Coroutine[Any, Any, Any], *args: Any) -> Any:
    """Call a function, `def` or `async def`, and return its result."""
    result = callback(*args) if callable(callback) else callback
    return await result if inspect.isawaitable(result) else result


class TimeoutObject:
    """A timeout that changes while an executor waits.

    Args:
        timeout: Seconds.
    """

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout


class Executor:
    """Base of executors, which own nodes. Subclasses define `spin_once`.

    Args:
        context: The context; None for the default one.

    Attributes:
        is_global: Whether it is the executor of `rclpy.spin`.

    Raises:
        RuntimeError: The context is not initialized, or has been shut down: an RCLError then.
    """

    is_global = False

    def __init__(self, *, context: Context | None = None) -> None:
        super().__init__()
        self._context = context or get_default_context()
        if self._context.handle is None:
            raise RuntimeError("The context must be initialized before an executor is made")
        if not self._context.ok():
            raise RCLError("The context of the executor has been shut down")
        self._nodes: dict[Node, NodeParts] = {}
        """With their parts: an object that delegates to a node may not do so any more when it is removed."""
        self._nodes_lock = threading.RLock()
        self.work = WorkQueue(self)
        self._is_shutdown = False
        # So that a context that ends, perhaps by a signal, wakes the thread that spins.
        self._context.track_executor(self)

    @property
    def context(self) -> Context:
        """The context."""
        return self._context

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.shutdown()

    # Nodes and tasks

    def add_node(self, node: Node) -> bool:
        """Run a node's callbacks from now on; return False if the executor does that already.

        Raises:
            RuntimeError: The process was forked after the node was made.
        """
        node.context.ok()  # raises that
        with self._nodes_lock:
            if node in self._nodes:
                return False
            parts = self._nodes[node] = parts_of(node)
        node.executor = self
        # Not by the node's attribute: an object that delegates to the node has just set its own.
        parts.active_executor = weakref.ref(self)
        for entity in parts.all_entities():
            # Messages may have arrived while no executor ran the node, when `notify` had nobody to tell.
            if entity.has_work():
                entity.notify()
        self.work.timers_changed()
        return True

    def remove_node(self, node: Node) -> None:
        """Run the node's callbacks no more."""
        with self._nodes_lock:
            parts = self._nodes.pop(node, None)
        if parts is None:
            return
        # Not if another executor has taken the node over. As in rclpy, `node.executor` stays.
        if parts.active_executor is not None and parts.active_executor() is self:
            parts.active_executor = None

    def get_nodes(self) -> list[Node]:
        """Return the nodes."""
        with self._nodes_lock:
            return list(self._nodes)

    def create_task(
        self, callback: Callable[..., Any] | Coroutine[Any, Any, Any], *args: Any, **kwargs: Any
    ) -> Task[Any]:
        """Run a function or a coroutine while the executor spins.

        Args:
            callback: The function, `def` or `async def`, or the coroutine.
            args: Its arguments.
            kwargs: Its keyword arguments.

        Returns:
            A future of its result.
        """
        task: Task[Any] = Task(callback, args, kwargs, executor=self)  # `Task[Any](...)` takes 1 us longer
        self.work.add_task(task)
        return task

    def create_future(self) -> Future[Any]:
        """Return a future whose callbacks the executor runs."""
        return Future(executor=self)

    def wake(self) -> None:
        """Look again at everything, as after a change."""
        self.work.wake()

    @property
    def is_shut_down(self) -> bool:
        """Whether it runs no further callbacks."""
        return self._is_shutdown

    def end_error(self) -> BaseException:
        """Return the exception for waits after its end, or its context's."""
        # In rclpy the shutdown of a context shuts the global executor down, too; here it may not have got
        # that far, since its first act is to wake those that wait.
        if self._is_shutdown or (self.is_global and self._context.is_shut_down):
            return ShutdownException()
        return self._context.end_error()

    def has_capacity(self) -> bool:
        """Return whether another piece of work can be run now."""
        return True

    def _execute(self, work: Work) -> None:
        """Run work in this thread, as far as it goes; raise what it raises."""
        if isinstance(work, Task):
            work()
            if work.done():
                work.result()
            return
        call, entity = work
        try:
            result = call()
        except BaseException:
            # Otherwise a callback that raises would block its callback group for good.
            self.work.ended(entity)
            raise
        if result is None or not inspect.iscoroutine(result):
            self.work.ended(entity)
            return
        task: Task[Any] = Task(result, executor=self)
        # The callback group is held until the coroutine ends, not until its first await.
        task.when_done(lambda: self.work.ended(entity))
        # At once, in this thread, and not by the queue: a coroutine without an await costs no round.
        self._execute(task)

    def wait_for_ready_callbacks(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        nodes: Iterable[Node] | None = None,
        condition: Callable[[], bool] = lambda: False,
    ) -> tuple[Task[Any], Entity | None, Node | None]:
        """Wait for work and return it, for executors that programs define.

        Args:
            timeout_sec: Seconds to wait; None or negative for no limit.
            nodes: Not used: the work is that of all nodes.
            condition: Waits end when it holds.

        Returns:
            A task to be called in any thread, with its entity and node: None for one of `create_task`.

        Raises:
            TimeoutException: There was none in time.
            ConditionReachedException: The condition holds.
            ShutdownException: The executor has been shut down.
            ExternalShutdownException: The context has been shut down.
        """
        del nodes
        work = self.work.wait(_seconds(timeout_sec), condition)
        if isinstance(work, Task):
            return work, None, None
        return Task[Any](self._execute, (work,), executor=self), work[1], cast("Node | None", work[1].node)

    # Spinning

    def spin(self) -> None:
        """Run callbacks until the context or the executor is shut down.

        Raises:
            ExternalShutdownException: The context was shut down while this waited, as by SIGTERM.
            Exception: A callback's, or that with which the thread of the nodes has failed.
        """
        while self._context.ok() and not self._is_shutdown:
            self.spin_once()
        self._raise_failure_of_context()

    def _raise_failure_of_context(self) -> None:
        if self._context.failure is not None:
            raise self._context.failure

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it.

        Args:
            timeout_sec: Seconds to wait; None or negative for no limit.
        """
        raise NotImplementedError

    def spin_until_future_complete(
        self, future: Future[Any], timeout_sec: float | TimeoutObject | None = None
    ) -> None:
        """Run callbacks until a future is done, or the time is over.

        Args:
            future: The future; one that is not rclpy's needs `done` and `add_done_callback`.
            timeout_sec: Seconds; None or negative for no limit.
        """
        seconds = _seconds(timeout_sec)
        end = inf if seconds is None or seconds < 0 else time.monotonic() + seconds
        self._wake_when_done(future)
        try:
            while self._context.ok() and not future.done() and not self._is_shutdown:
                rest = None if end == inf else max(0.0, end - time.monotonic())
                self._spin_once_until(future.done, rest)
                if rest is not None and time.monotonic() >= end:
                    return
        finally:
            self._forget(future)
        if not future.done():
            self._raise_failure_of_context()

    def spin_once_until_future_complete(
        self, future: Future[Any], timeout_sec: float | TimeoutObject | None = None
    ) -> None:
        """Wait for one callback and run it, or until a future is done.

        Args:
            future: The future.
            timeout_sec: Seconds to wait; None or negative for no limit.
        """
        self._wake_when_done(future)
        try:
            self._spin_once_until(future.done, _seconds(timeout_sec))
        finally:
            self._forget(future)

    def _wake_when_done(self, future: Any) -> None:
        """End waits when a future is done: it may be in another thread, without work for this executor."""
        if isinstance(future, Future):
            future.when_done(self.work.wake)
        else:  # such as one of `concurrent.futures`

            def done(future: object) -> None:
                del future
                self.work.wake()

            future.add_done_callback(done)

    def _forget(self, future: Any) -> None:
        # A future that is waited for again and again, a little at a time, would collect these.
        if isinstance(future, Future):
            future.forget(self.work.wake)

    def _spin_once_until(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        """Run one callback, unless the condition holds first. Executors of programs may lack this."""
        del condition
        self.spin_once(timeout_sec)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Run no further callbacks. One that runs in another thread goes on.

        Args:
            timeout_sec: Not used: there is no thread to wait for.

        Returns:
            True.
        """
        del timeout_sec
        self._is_shutdown = True
        # Threads that spin must see that it is over.
        self.work.wake()
        with self._nodes_lock:
            self._nodes.clear()
        return True


class SingleThreadedExecutor(Executor):
    """Runs callbacks in the thread that spins."""

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it."""
        self._spin_once_until(_never, timeout_sec)

    def _spin_once_until(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        try:
            work = self.work.wait(timeout_sec, condition)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        try:
            self._execute(work)
        except BaseException:
            # The error is often a consequence of the end of the program, in a thread that nobody waits for.
            park_at_exit()
            raise


class MultiThreadedExecutor(Executor):
    """Runs callbacks in a pool of threads.

    Args:
        num_threads: Threads of the pool; None: as many as this process may use processors.
        context: The context; None for the default one.
    """

    def __init__(self, num_threads: int | None = None, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        if num_threads is None:
            affinity = getattr(os, "sched_getaffinity", None)
            num_threads = len(affinity(0)) if affinity else os.cpu_count() or 2
        if num_threads == 1:
            warnings.warn(
                "MultiThreadedExecutor is used with a single thread.\n"
                "Use the SingleThreadedExecutor instead.",
                stacklevel=2,
            )
        self._threads = num_threads
        self._this_thread = threading.local()
        """Has `in_pool` in the pool's threads."""
        self._pool = ThreadPoolExecutor(
            num_threads,
            thread_name_prefix="rclpy-callbacks",
            initializer=setattr,
            initargs=(self._this_thread, "in_pool", True),
        )
        # Pieces of work that were given to the pool and have not ended. It is compared with the number of
        # threads, since a pool has an endless queue of its own.
        self._running = 0
        self._shutting_down = 0
        """Number of running callbacks that wait in `shutdown`."""
        self._idle = threading.Condition()
        self._failures: deque[BaseException] = deque()
        self._spinning_ended = False
        """Whether spinning has ended for good: later failures are printed, as nothing raises them."""

    def spin(self) -> None:
        """Run callbacks until the context or the executor is shut down."""
        super().spin()
        self._end_spinning()

    def has_capacity(self) -> bool:
        """Return whether a thread is free."""
        # Messages should wait for a thread in their subscription, whose depth limits them.
        return self._running < self._threads

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and give it to the pool; raise the error of an earlier one."""
        self._spin_once_until(_never, timeout_sec)

    def _spin_once_until(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        try:
            # A failure in the pool ends the wait, so that it is raised soon and not with the next message.
            work = self.work.wait(timeout_sec, lambda: bool(self._failures) or condition())
        except (ExternalShutdownException, ShutdownException):
            self._end_spinning()
            return
        except (TimeoutException, ConditionReachedException):
            self._raise_failure()
            return
        with self._idle:
            # Under the lock that `shutdown` waits with: work that begins after it has looked would run
            # unseen.
            shut_down = self._is_shutdown
            self._running += not shut_down  # `shutdown` waits for it
        if shut_down:
            if not isinstance(work, Task):
                self.work.ended(work[1])
            return
        try:
            self._pool.submit(self._run, work)
        except RuntimeError:  # the program exits, which ends all pools
            park_at_exit(pools_ended=True)
            raise
        self._raise_failure()

    def _end_spinning(self) -> None:
        with self._idle:
            self._spinning_ended = True
        self._raise_failure()

    def _raise_failure(self) -> None:
        if self._failures:
            park_at_exit()
            raise self._failures.popleft()

    def _run(self, work: Work) -> None:
        try:
            self._execute(work)
        except BaseException as error:  # noqa: BLE001 - raised where the executor spins
            self._failed(error)
        finally:
            with self._idle:
                self._running -= 1
                self._idle.notify_all()
            # A thread of the pool is free, and a callback group may be.
            self.work.wake()

    def _failed(self, error: BaseException) -> None:
        with self._idle:
            ended = self._spinning_ended
            if not ended:
                self._failures.append(error)
        if ended and not isinstance(error, (ExternalShutdownException, InvalidHandle)):  # caused by the end
            arguments = (type(error), error, error.__traceback__, threading.current_thread())
            threading.excepthook(threading.ExceptHookArgs(arguments))

    def shutdown(self, timeout_sec: float | None = None, *, wait_for_threads: bool = True) -> bool:
        """Run no further callbacks.

        Args:
            timeout_sec: Seconds to wait for those that run; None or negative for no limit. A callback that
                calls this waits for the others.
            wait_for_threads: Whether to wait for the end of the pool's threads, too; not in a callback.

        Returns:
            Whether none runs any more.
        """
        super().shutdown()
        unlimited = timeout_sec is None or timeout_sec < 0
        in_callback: bool = getattr(self._this_thread, "in_pool", False)
        with self._idle:
            # A callback that shuts its own executor down cannot wait for itself; two at once must not wait
            # for each other.
            self._shutting_down += in_callback
            self._idle.notify_all()
            try:
                ended = self._idle.wait_for(
                    lambda: self._running <= self._shutting_down, None if unlimited else timeout_sec
                )
            finally:
                self._shutting_down -= in_callback
        if ended:
            self._pool.shutdown(wait=wait_for_threads and not in_callback)
        return ended


def _seconds(timeout: float | TimeoutObject | None) -> float | None:
    return timeout.timeout if isinstance(timeout, TimeoutObject) else timeout


def _never() -> Literal[False]:
    return False
