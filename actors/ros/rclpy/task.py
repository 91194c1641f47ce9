"""Futures and tasks of executors."""

from __future__ import annotations

import asyncio
import inspect
import sys
import threading
import warnings
import weakref
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar, cast

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Generator, Sequence

T = TypeVar("T")


class _Awaited(threading.local):
    """What tasks of executors know of the coroutine that this thread runs, or has just run.

    Attributes:
        future: What it awaits; None if it is no `Future`.
        in_executor: Whether an executor runs it now.
    """

    future: Future[Any] | None = None
    in_executor = False


_awaited: Final = _Awaited()


class TaskQueue(Protocol):
    """The part of an executor's work queue that tasks use."""

    def resume_later(self, task: Task[Any], awaited: Future[Any] | None, /) -> None:
        """Resume a task when the future that it awaits is done; None: it awaits something else."""
        ...

    def forget(self, task: Task[Any], /) -> None:
        """Forget a task that awaits a future: it was cancelled."""
        ...


class FutureExecutor(Protocol):
    """The part of an executor that futures use. A protocol: executors import this module."""

    def create_task(self, callback: Callable[..., Any], /, *args: Any) -> object:
        """Run a function while the executor spins."""
        ...


class TaskExecutor(FutureExecutor, Protocol):
    """The part that tasks use."""

    @property
    def work(self) -> TaskQueue:
        """The queue of its work."""
        ...


class FutureState(Enum):
    """The states of a future."""

    PENDING = "PENDING"
    CANCELLED = "CANCELLED"
    FINISHED = "FINISHED"


class Future(Generic[T]):
    """The outcome of something that may not have happened yet. Every method may be called in any thread.

    Args:
        executor: Runs the callbacks; without one they run where the future is completed.
    """

    def __init__(self, *, executor: FutureExecutor | None = None) -> None:
        self._done = False
        self._cancelled = False
        self._result: T | None = None
        self._exception: BaseException | None = None
        self._retrieved = True
        self._callbacks: list[Callable[[Any], object]] = []
        # Apart from the callbacks: these must run at once, and in any thread, whereas an executor runs the
        # callbacks.
        self._waiting: list[Callable[[], object]] = []
        """Functions of `when_done`, which wake tasks and threads that wait."""
        self._lock = threading.Lock()
        # Weak, since the executor's queue refers to its tasks.
        self._executor: weakref.ref[FutureExecutor] | None = None
        self.set_executor(executor)

    def __del__(self) -> None:
        if not self._retrieved:
            print("The following exception was never retrieved: " + str(self._exception), file=sys.stderr)  # noqa: T201 - rclpy's text; logging may be gone

    def __await__(self) -> Generator[None, None, T | None]:
        if not (self._done or _awaited.in_executor) and (loop := _loop_of_task()) is not None:
            yield from self._wait_in(loop).__await__()
        while not self._done:
            # The executor learns of the future this way and not by the yielded value: a coroutine may also
            # await objects of other libraries, which yield anything.
            _awaited.future = self
            yield
        return self.result()

    async def _wait_in(self, loop: asyncio.AbstractEventLoop) -> None:
        """Wait in a task of asyncio."""
        done = asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop is closed, and so is the task
                loop.call_soon_threadsafe(done.set)

        self.when_done(wake)
        try:
            await done.wait()
        finally:
            self.forget(wake)

    def set_executor(self, executor: FutureExecutor | None) -> None:
        """Set the executor that runs the callbacks; None: they run where the future is completed."""
        self._executor = None if executor is None else weakref.ref(executor)

    def cancel(self) -> None:
        """Complete the future without a result, if it is not done."""
        self._complete(None, None, cancelled=True)

    def cancelled(self) -> bool:
        """Return whether it was cancelled."""
        return self._cancelled

    def done(self) -> bool:
        """Return whether it has a result or an exception, or was cancelled."""
        return self._done

    def result(self) -> T | None:
        """Return the result, or None; raise the exception if there is one."""
        error = self.exception()
        if error is not None:
            raise error
        return self._result

    def exception(self) -> BaseException | None:
        """Return the exception, or None."""
        # The thread that runs this raises the error: no second message about it when the task is freed.
        self._retrieved = True
        return self._exception

    def set_result(self, result: T) -> None:
        """Complete the future with a result."""
        self._complete(result, None)

    def set_exception(self, exception: BaseException) -> None:
        """Complete the future with an exception."""
        self._complete(None, exception)

    def _complete(self, result: T | None, error: BaseException | None, *, cancelled: bool = False) -> None:
        with self._lock:
            # Only `cancel` respects an outcome that is there: in rclpy a second `set_result` replaces the
            # first.
            if cancelled and self._done:
                return
            self._result, self._exception, self._retrieved = result, error, error is None
            self._done, self._cancelled = True, cancelled
            callbacks, self._callbacks = self._callbacks, []
            waiting, self._waiting = self._waiting, []
        # Outside the lock, as they may call methods of this future.
        for wake in waiting:
            wake()
        for callback in callbacks:
            try:
                self._call(callback)
            except Exception as raised:  # noqa: BLE001 - the user's: the others must be called as well
                warnings.warn(f"Unhandled exception in done callback: {raised}", stacklevel=2)

    def _call(self, callback: Callable[[Any], object]) -> None:
        executor = None if self._executor is None else self._executor()
        if executor is None:
            callback(self)
        else:
            executor.create_task(callback, self)

    def add_done_callback(self, callback: Callable[[Any], object]) -> None:
        """Call a function with the future when it is done, or at once if it is.

        If there is an executor, it runs the function.
        """
        with self._lock:
            if not self._done:
                self._callbacks.append(callback)
                return
        self._call(callback)

    def remove_done_callback(self, callback: Callable[[Any], object]) -> bool:
        """Do not call a function of `add_done_callback`; return whether it would have been called."""
        with self._lock:
            try:
                self._callbacks.remove(callback)
            except ValueError:
                return False
            return True

    def when_done(self, wake: Callable[[], object]) -> None:
        """Call a function that never raises when the future is done, in the thread where that happens."""
        with self._lock:
            if not self._done:
                self._waiting.append(wake)
                return
        wake()

    def forget(self, wake: Callable[[], object]) -> None:
        """Do not call a function of `when_done` any more."""
        with self._lock:
            if wake in self._waiting:  # it has not been called
                self._waiting.remove(wake)


def _loop_of_task() -> asyncio.AbstractEventLoop | None:
    """Return the loop of the task of asyncio that runs; None if none does."""
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        return None
    return None if asyncio.current_task(loop) is None else loop


class Task(Future[T]):
    """A function or a coroutine that an executor runs to its end.

    Args:
        handler: The function, `def` or `async def`, or a coroutine.
        args: Its arguments.
        kwargs: Its keyword arguments.
        executor: Resumes it.
    """

    def __init__(
        self,
        handler: Callable[..., Any] | Coroutine[Any, Any, Any],
        args: Sequence[Any] = (),
        kwargs: dict[str, Any] | None = None,
        executor: TaskExecutor | None = None,
    ) -> None:
        super().__init__(executor=executor)
        # A coroutine function runs nothing when it is called; from here on there are two kinds of handlers,
        # not three.
        made = handler(*args, **(kwargs or {})) if inspect.iscoroutinefunction(handler) else handler
        self._handler: Any = made
        self._args, self._kwargs = args, kwargs or {}
        self._running = threading.Lock()

    def cancel(self) -> None:
        """Complete the task without a result, if it is not done; a coroutine ends where it waits."""
        # Python refuses to close a coroutine that is running. Then the thread that runs it closes it.
        if self._running.acquire(blocking=False):
            try:
                self._close()
                super().cancel()
            finally:
                self._running.release()
        else:
            super().cancel()  # it is closed when it waits next
        queue = self._queue()
        if queue is not None:
            queue.forget(self)

    def _queue(self) -> TaskQueue | None:
        executor = None if self._executor is None else self._executor()
        return None if executor is None else cast("TaskExecutor", executor).work

    def _close(self) -> None:
        handler = self._handler
        if inspect.iscoroutine(handler):
            self._handler = None
            handler.close()

    def __call__(self) -> None:
        """Run the function, or the coroutine until it waits; do nothing if it is done or runs already."""
        # Two threads may have found it: it is queued again when it is woken twice.
        if self._done or not self._running.acquire(blocking=False):
            return
        suspended = False
        try:
            if inspect.iscoroutine(self._handler):
                suspended = self._resume(self._handler)
                if suspended and self._done:  # cancelled meanwhile
                    suspended = False
                    self._close()
            elif not self._done:
                self._run()
        finally:
            self._running.release()
        queue = self._queue() if suspended else None
        if queue is not None:  # not before: another thread may resume it at once
            queue.resume_later(self, _awaited.future)

    def _run(self) -> None:
        try:
            result = self._handler(*self._args, **self._kwargs)
        except Exception as error:  # noqa: BLE001 - the user's: it is the task's outcome
            self._end(None, error)
        except BaseException as error:
            self._interrupted(error)
            raise
        else:
            self._end(result, None)

    def _resume(self, coroutine: Coroutine[Any, Any, Any]) -> bool:
        """Run the coroutine until it waits; return whether it does."""
        _awaited.future, outer = None, _awaited.in_executor
        _awaited.in_executor = True
        try:
            coroutine.send(None)
        except StopIteration as end:
            self._end(end.value, None)
        except Exception as error:  # noqa: BLE001 - the user's: it is the task's outcome
            self._end(None, error)
        except BaseException as error:
            self._interrupted(error)
            raise
        else:
            return True
        finally:
            _awaited.in_executor = outer
        return False

    def _interrupted(self, error: BaseException) -> None:
        """End with an error that is for the thread that runs this, such as KeyboardInterrupt."""
        self._end(None, error)
        self._retrieved = True

    def _end(self, result: Any, error: BaseException | None) -> None:
        # Arguments may be large, and the future may be kept for its result.
        self._handler, self._args, self._kwargs = None, (), {}
        self._complete(result, error)

    def executing(self) -> bool:
        """Return whether a thread runs it now."""
        return self._running.locked()
