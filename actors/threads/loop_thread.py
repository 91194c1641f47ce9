"""An event loop in a thread, and calls into it.

Every accepted call is in `_calls` until it has ended. The thread that removes it there completes its future:
the loop's thread when the coroutine has ended, or the thread that stops the loop. So a call ends even if the
loop is blocked.
"""

from __future__ import annotations

import asyncio
import atexit
import os
import threading
import weakref
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.callbacks.functions import as_coroutine
from actors.errors import CallCancelled, WaitTimeout
from actors.node.node_runner import GRACE_SEC
from actors.runtime.remaining_tasks import end_remaining_tasks
from actors.runtime.run import LAST_TASKS_SEC
from actors.threads.errors import ThreadStopped, TooManyCalls
from proto.aio.process import new_event_loop
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    Work = Coroutine[Any, Any, Any] | Callable[[], Any]

T = TypeVar("T")

STOP_TIMEOUT_SEC: Final = 30.0
"""How long to wait for the thread's end: enough for four nodes whose callbacks ignore cancellation."""

LOCK_SEC: Final = 0.1
"""How long to wait for a thread that posts. Not forever: it may be in a signal handler that waits for the
loop's end."""

MAX_CALLS: Final = 100_000
"""Calls that have not ended. More of them mean that the loop is blocked, or that results are not awaited."""


class LoopThread:
    """Runs an event loop in a thread.

    Args:
        name: The thread's name.
        loop_factory: Makes the loop; None: uvloop's, if it is installed.
        leave: Called in the loop before it ends, when the calls have ended.

    Attributes:
        ended: Done when the thread ends, with the error if it failed.
    """

    def __init__(
        self,
        name: str,
        loop_factory: Callable[[], asyncio.AbstractEventLoop] | None,
        leave: Callable[[], Coroutine[Any, Any, None]],
    ) -> None:
        self.ended: Future[None] = Future()
        self._loop_factory = loop_factory or new_event_loop
        self._leave = leave
        # A daemon, because at exit Python waits for other threads before it calls `atexit`, which stops this
        # one.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._pid = 0
        # Whether `post` may use the loop. Separate from `_thread.is_alive()`: the thread lives on while it
        # leaves its nodes, and calls that are accepted then would never run.
        self._running = False
        self._lock = threading.RLock()  # a signal handler may interrupt `post`, and post as well
        """Held while `_running` changes, and from checking it until a callback is in the loop's queue."""
        # Membership decides which thread completes a call. `set.remove` is atomic under the GIL, so that
        # exactly one thread gets through; a lock here could be held by a thread that a signal handler
        # interrupts.
        self._calls: set[Future[Any]] = set()
        self._tasks: dict[asyncio.Task[Any], Future[Any]] = {}
        self._failure: BaseException | None = None
        self._started: Future[asyncio.AbstractEventLoop] = Future()
        self._stop_asked: asyncio.Event

    def start(self) -> None:
        """Start the thread; return when its loop runs."""
        self._thread.start()
        # Raises what the loop factory raised, in the thread that called `start`.
        self._loop = self._started.result()
        # A forked child has this object, but not the thread: calls would wait for ever.
        self._pid = os.getpid()
        self._running = True
        _threads.add(self)
        # Without it a daemon thread is frozen in the middle of what it does when Python exits, and messages
        # that were published just before would be lost.
        atexit.register(self.stop)

    def _run(self) -> None:
        self.ended.set_running_or_notify_cancel()  # so that nobody can cancel it
        try:
            with closing(self._loop_factory()) as loop:
                self._run_loop(loop)
        except BaseException as error:  # noqa: BLE001 - raised where the thread is stopped
            self._failure = self._failure or error
        # Again, after `_serve` has done it: if the loop failed before, callers still wait.
        self.refuse_calls()
        failure = self._failure
        # The loop factory has failed: `start` waits for this future.
        if not self._started.done():
            self._started.set_exception(failure or ThreadStopped("The loop has ended at once"))
        if failure is None:
            self.ended.set_result(None)
        else:
            self.ended.set_exception(failure)

    def _run_loop(self, loop: asyncio.AbstractEventLoop) -> None:
        # asyncio.Runner ends the executor with a new thread, which Python refuses while it exits.
        executor = ThreadPoolExecutor(thread_name_prefix=self._thread.name)
        loop.set_default_executor(executor)
        try:
            loop.run_until_complete(self._serve())
        except BaseException as error:
            self._failure = error  # SystemExit in a callback: the cause for calls that end now
            raise
        finally:
            loop.run_until_complete(end_remaining_tasks(LAST_TASKS_SEC))
            loop.run_until_complete(loop.shutdown_asyncgens())
            executor.shutdown(cancel_futures=True)

    async def _serve(self) -> None:
        self._stop_asked = asyncio.Event()
        self._started.set_result(asyncio.get_running_loop())
        try:
            await self._stop_asked.wait()
        finally:
            # First nothing new, then the end of what runs, and the nodes last: calls in flight use the
            # nodes.
            self.refuse_calls()
            await asyncio.sleep(0)  # everything that was accepted has begun
            for task in self._tasks:
                task.cancel()
            if self._tasks:
                await asyncio.wait(self._tasks, timeout=GRACE_SEC)
            await self._leave()

    def fail(self, error: BaseException) -> None:
        """End the thread with an error; for the loop's thread."""
        # The first error is the cause. Those after it are mostly its consequences.
        self._failure = self._failure or error
        self._stop_asked.set()

    def require_running(self) -> None:
        """Raise ThreadStopped unless the thread runs, in this process."""
        if not self._running:
            raise self._stopped()

    def _stopped(self) -> ThreadStopped:
        if not self._pid:
            why = "has not been started"
        elif self._pid != os.getpid():
            why = "runs in the parent process: start one after the fork"
        elif self._failure is not None:
            why = f"has ended: {type(self._failure).__name__}: {self._failure}"
        else:
            why = "has been stopped"
        error = ThreadStopped(f"The thread '{self._thread.name}' {why}")
        error.__cause__ = self._failure
        return error

    def post(self, callback: Callable[..., object], *args: Any) -> None:
        """Call a function in the loop, after those before it; raise ThreadStopped if it has ended."""
        self.require_running()  # before the lock: in a forked child nobody may be left to release it
        with self._lock:
            # Again under the lock, which `refuse_calls` holds while it ends the thread: between the two, a
            # callback would be put into the queue of a loop that never runs it.
            self.require_running()
            try:
                self._loop.call_soon_threadsafe(callback, *args)
            except RuntimeError:  # closed: a signal handler has stopped the thread just now
                self.require_running()
                raise

    def submit(self, work: Work) -> Future[Any]:
        """Run a coroutine, or a function and the coroutine that it returns, in the loop."""
        future: Future[Any] = Future()
        self._submit(future, work)
        return future

    def _submit(self, future: Future[Any], work: Work) -> None:
        if not (callable(work) or hasattr(work, "send")):
            raise TypeError(f"Expected a coroutine or a function, such as a lambda, not {work!r}")
        try:
            if len(self._calls) >= MAX_CALLS:
                raise TooManyCalls(f"{MAX_CALLS} calls in '{self._thread.name}' have not ended")
            # Before `post`: the loop may have completed the call before this thread goes on.
            self._calls.add(future)
            self.post(self._begin, future, work)
        except CallboardError:
            self._calls.discard(future)
            _close(work)
            raise

    def call(self, work: Work, timeout_sec: float | None) -> Any:
        """Return the result of `submit`; cancel it after `timeout_sec`, or if this thread is interrupted."""
        try:
            self._require_other_thread("call")
        except RuntimeError:
            _close(work)
            raise
        future: Future[Any] = Future()  # not from `submit`, so that Ctrl-C finds it at any time
        try:
            self._submit(future, work)
            return future.result(timeout_sec)
        except TimeoutError:
            # False: the loop has completed it just now.
            if future.cancel():
                raise WaitTimeout(f"The call did not end within {timeout_sec:g} s") from None
            return future.result()  # it has ended meanwhile, perhaps with a TimeoutError of its own
        except BaseException:
            future.cancel()  # Ctrl-C, while it runs
            raise

    def _begin(self, future: Future[Any], work: Work) -> None:
        if future.done():
            _close(work)
            # Cancelled while it was in the queue: it never begins, and has no side effects.
            self._complete(future, None)
            return
        task = self._loop.create_task(_run_work(work))
        self._tasks[task] = future
        task.add_done_callback(self._task_ended)

        def cancel_task(future: Future[Any]) -> None:
            del future
            # Also called when the task has ended by itself, since that completes the future. Then there is
            # nothing to cancel.
            if not task.done():
                with suppress(RuntimeError):  # the loop is closed
                    self._loop.call_soon_threadsafe(task.cancel)

        future.add_done_callback(cancel_task)

    def _task_ended(self, task: asyncio.Task[Any]) -> None:
        self._complete(self._tasks.pop(task), task)

    def _complete(self, future: Future[Any], task: asyncio.Task[Any] | None) -> None:
        """Give a call its result, or ThreadStopped without a task; do nothing if it is complete."""
        try:
            self._calls.remove(future)
        except KeyError:
            return
        # The caller has cancelled it. This also keeps `cancel` from succeeding between here and
        # `set_result`.
        if not future.set_running_or_notify_cancel():
            return
        # CancelledError is for those whose own task was cancelled; a caller in another thread has none.
        if task is not None and task.cancelled() and self._running:
            future.set_exception(CallCancelled("The coroutine was cancelled in the loop, not by the caller"))
        elif task is None or task.cancelled():
            future.set_exception(self._stopped())
        elif (error := task.exception()) is not None:
            future.set_exception(error)
        else:
            future.set_result(task.result())

    def refuse_calls(self) -> None:
        """Accept no further calls, and end those that run with ThreadStopped."""
        # With a limit, and going on without the lock after it: the thread that holds it may be waiting, in
        # a signal handler, for the end of this one. The worst case is then a callback that never runs,
        # whose call ends below.
        locked = self._lock.acquire(timeout=LOCK_SEC)
        self._running = False
        if locked:
            self._lock.release()
        # Here, in the thread that stops, and not in the loop: the loop may be blocked in a callback.
        for future in self._calls.copy():
            self._complete(future, None)

    def stop(self, timeout_sec: float = STOP_TIMEOUT_SEC) -> None:
        """End the calls, leave everything, wait for the thread to end, and raise its error if it failed."""
        failure = self.join(timeout_sec)
        if failure is not None:
            raise failure

    def forked(self) -> None:
        """Refuse calls in a forked child, where the thread does not exist."""
        self._running = False  # without the lock, which another thread may have held

    def join(self, timeout_sec: float = STOP_TIMEOUT_SEC) -> BaseException | None:
        """Stop as `stop` does, but return the error with which the thread failed."""
        if self._pid != os.getpid():  # not started, or another process's
            return None
        self._require_other_thread("stop")
        self.refuse_calls()
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._stop_asked.set)
        self._thread.join(timeout_sec)
        if self._thread.is_alive():
            raise WaitTimeout(
                f"The thread '{self._thread.name}' did not end within {timeout_sec:g} s: a callback blocks it"
            )
        # Only now. If the wait has timed out, the end of the program tries once more.
        atexit.unregister(self.stop)
        return self._failure

    def _require_other_thread(self, what: str) -> None:
        if threading.get_ident() == self._thread.ident:
            raise RuntimeError(
                f"{what}() in the thread '{self._thread.name}' would wait for itself for ever:"
                " await the coroutine, or use another thread"
            )


_threads: Final[weakref.WeakSet[LoopThread]] = weakref.WeakSet()
"""Threads that have been started, here or in the parent process before a fork."""


def _after_fork_in_child() -> None:
    for thread in tuple(_threads):
        thread.forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)


async def _run_work(work: Work) -> Any:
    result = work() if callable(work) else work
    coroutine = as_coroutine(result)
    return result if coroutine is None else await coroutine


def _close(work: Work) -> None:
    if not callable(work):
        work.close()
