"""Contexts: `init` begins one, and `shutdown` ends it."""

from __future__ import annotations

import atexit
import os
import sys
import threading
import warnings
import weakref
from concurrent.futures import CancelledError
from contextlib import ExitStack, suppress
from inspect import ismethod
from typing import TYPE_CHECKING, Any, Final, Protocol, Self, TypeVar

from actors.arguments.ros_arguments import (
    InvalidRosArgumentError,
    RosArguments,
    UnknownRosArgumentError,
    parse_ros_arguments,
)
from actors.config.environment import domain_id as environment_domain
from actors.errors import NodeDestroyed
from actors.ros.process_thread import process_thread
from actors.ros.rclpy._rclpy_pybind11 import RCLError, RCLInvalidROSArgsError, UnknownROSArgsError
from actors.ros.rclpy.destroyable import VALID, Handle
from actors.ros.rclpy.exceptions import NotInitializedException
from actors.ros.rclpy.console_output import console_output
from actors.ros.rclpy.topic_types import TopicTypes
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.runtime.run import set_up_logging
from actors.threads.errors import ThreadStopped

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator, Sequence
    from concurrent.futures import Future as Reply
    from contextlib import AbstractAsyncContextManager
    from types import TracebackType

    from actors.threads.node_thread import NodeThread


T = TypeVar("T")


class ContextNode(Protocol):
    """The part of a node that its context uses. A protocol, because nodes import this module."""

    def destroy_node(self) -> object:
        """Take the node out of service."""
        ...


class ContextExecutor(Protocol):
    """The part of an executor that its context uses."""

    def wake(self) -> None:
        """Look whether the context has ended."""
        ...


class Context:
    """The lifetime of nodes: they can be made while it is ok, and are destroyed when it is shut down.

    Attributes:
        arguments: The ROS arguments of its nodes.
        domain_id: Its domain; None for the environment's.
        topic_types: The types of the topics of its nodes.
        failure: The error with which the thread of its nodes has failed, which has ended the context.
    """

    def __init__(self) -> None:
        self.arguments = RosArguments()
        self.domain_id: int | None = None
        # Not taken by what signal handlers call: they interrupt a thread that may hold it.
        self._lock = threading.RLock()
        self._initialized = self._ok = self._ended = self._forked = False
        self._callbacks: list[weakref.WeakMethod[Any] | Callable[[], object]] = []
        # Weak, as in rclpy: a node that a program drops is destroyed with its last reference, not with the
        # context.
        self._nodes: tuple[weakref.ref[ContextNode], ...] = ()
        self._natives: weakref.WeakSet[AbstractAsyncContextManager[Any]] = weakref.WeakSet()
        """The nodes of callboard. Some outlive theirs: those of publishers that a program keeps."""
        self._executors: tuple[weakref.ref[ContextExecutor], ...] = ()
        """Replaced, never changed: a signal handler reads it, and `_waits`."""
        self._waits: tuple[Reply[Any], ...] = ()
        self.topic_types = TopicTypes()
        self._thread: NodeThread | None = None
        self.failure: BaseException | None = None

    @property
    def handle(self) -> Handle | None:
        """A handle once the context is initialized; None before that."""
        return VALID if self._initialized else None

    @property
    def thread(self) -> NodeThread:
        """The thread in which the nodes live; raise NotInitializedException unless the context is ok."""
        thread = self._thread
        if thread is None or not self.ok():
            raise NotInitializedException
        return thread

    def init(
        self,
        args: Sequence[str] | None = None,
        *,
        initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None:
        """Make nodes possible.

        Args:
            args: Command-line arguments; None: those of the process.
            initialize_logging: Send the log to stderr.
            domain_id: The domain of the nodes; None for the environment's.

        Raises:
            RuntimeError: It has been initialized before, or the domain is negative.
            UnknownROSArgsError: A ROS argument is unknown.
            RCLError: A ROS argument is wrong.
            InvalidEnvironmentError: The domain of the environment is not an integer from 0 to 232, or a
                variable of the log is neither 0 nor 1.
        """
        with self._lock:
            if domain_id is not None and domain_id < 0:
                raise RuntimeError(f"Domain id ({domain_id}) should not be lower than zero.")
            if self._initialized:
                raise RuntimeError("Context.init() must only be called once")
            self.arguments = parsed_arguments(sys.argv if args is None else args)
            self.domain_id = environment_domain(ros=True) if domain_id is None else domain_id
            if initialize_logging:
                set_up_logging(self.arguments, **console_output())
            # After everything that can fail: no thread starts for a context with wrong arguments.
            self._thread = _thread_for(self)
            self._initialized = self._ok = True
            if self._thread.ended.done():  # has failed just now
                self.thread_ended(self._thread.ended)

    def ok(self) -> bool:
        """Return whether it is initialized and not shut down.

        Raises:
            RuntimeError: The process was forked since; the nodes are its parent's.
        """
        if self._forked:
            raise RuntimeError(
                "The process was forked after rclpy.init(), and its nodes stay the parent's:"
                " call rclpy.init() and make nodes in the child"
            )
        return self._ok

    @property
    def is_shut_down(self) -> bool:
        """Whether it has been shut down, and has not only ended, as by a signal."""
        return self._ended

    def forked(self) -> None:
        """Refuse all use in a forked child."""
        self._ended = self._forked = self._initialized
        self._ok = False

    def track_node(self, node: ContextNode) -> bool:
        """Destroy a node when the context is shut down; return False if it is shut down already."""
        with self._lock:
            if self._ended:
                return False
            self._nodes = (*(each for each in self._nodes if each() is not None), weakref.ref(node))
            return True

    def untrack_node(self, node: ContextNode) -> None:
        """Forget a node."""
        with self._lock:
            self._nodes = tuple(each for each in self._nodes if each() not in {None, node})

    def track_native(self, native: AbstractAsyncContextManager[Any]) -> None:
        """Leave a node of callboard when the context is shut down, if it has not been left by then."""
        self._natives.add(native)

    def track_executor(self, executor: ContextExecutor) -> None:
        """Wake an executor when the context ends."""
        with self._lock:
            alive = (each for each in self._executors if each() is not None)
            self._executors = (*alive, weakref.ref(executor))

    def end(self) -> None:
        """Stop being ok, wake the executors and cancel the waits. Takes no lock: signal handlers call it."""
        self._ok = False
        for wait in self._waits:
            # Threads that wait for the loop do not spin, so waking the executors would not reach them.
            wait.cancel()
        for each in self._executors:
            executor = each()
            if executor is not None:
                executor.wake()

    def thread_ended(self, ended: Reply[None]) -> None:
        """End because the thread of the nodes has ended."""
        # A context may outlive its thread and be told of the end of another one.
        if self._thread is not None and self._thread.ended is ended:
            if self._ok:
                self.failure = ended.exception()
            self.end()

    def end_error(self) -> BaseException:
        """Return the exception for waits that end because the context has ended.

        While the program exits, this blocks daemon threads for ever: see `park_at_exit`.
        """
        park_at_exit()
        return self.failure or ExternalShutdownException()

    def shutdown(self) -> None:
        """Destroy the nodes, end all spinning, and call the callbacks of `on_shutdown`.

        Raises:
            RuntimeError: It is not initialized, or has been shut down before.
        """
        if not self._initialized:
            raise RuntimeError("Context must be initialized before it can be shutdown")
        if not self._clean_up():
            raise RCLError("Context has already been shut down")

    def destroy(self) -> None:
        """Shut down, unless that has been done."""
        self.try_shutdown()

    def try_shutdown(self) -> None:
        """Shut down, unless that has been done or the context has never been initialized."""
        if self._initialized:
            self._clean_up()

    def _clean_up(self) -> bool:
        """Shut down, also after a signal; return whether it was the first call."""
        with self._lock:
            if self._ended:
                return False
            self._ended = True
            nodes, callbacks = self._nodes, self._callbacks
            self._callbacks = []
        # First, so that spinning threads stop before their nodes are destroyed.
        self.end()
        with ExitStack() as last_first:  # after an error it still calls the others
            last_first.callback(self._leave_natives)
            for callback in reversed(callbacks):
                last_first.callback(_call, callback)
            for each in reversed(nodes):
                node = each()
                if node is not None:
                    last_first.callback(node.destroy_node)
        return True

    def _leave_natives(self) -> None:
        for native in tuple(self._natives):
            with suppress(ThreadStopped, LookupError):  # it has been left
                if self._thread is not None:
                    self._thread.leave(native)

    def on_shutdown(self, callback: Callable[[], object]) -> None:
        """Call a function when the context is shut down, or at once if it has been.

        Methods are held weakly.
        """
        if not callable(callback):
            raise TypeError(f"callback should be a callable, got {type(callback)}")
        with self._lock:
            if not self._ended:
                self._callbacks.append(weakref.WeakMethod(callback) if ismethod(callback) else callback)
                return
        callback()

    def wait(self, work: Callable[[], Coroutine[Any, Any, T]], timeout_sec: float | None = None) -> T:
        """Run a coroutine in the loop and wait for its result, in any other thread.

        Args:
            work: Returns the coroutine.
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            Its result.

        Raises:
            ExternalShutdownException: The context has ended meanwhile, also by a signal.
            Exception: The context has ended because the thread of the nodes has failed, with this error.
            TimeoutError: The coroutine did not end in time, and has been cancelled.
            Exception: The coroutine's.
        """
        return self.wait_for(self.thread.submit(work), timeout_sec)

    def wait_for(self, wait: Reply[T], timeout_sec: float | None = None) -> T:
        """Wait for a future and return its result, as `wait` does; cancel it if the wait ends before."""
        with self._lock:
            self._waits = (*self._waits, wait)
        try:
            # It has ended since the check in `thread`. After the wait is registered, so that `end` finds it
            # or this does.
            if not self._ok:
                wait.cancel()
            return wait.result(timeout_sec)
        except (CancelledError, NodeDestroyed):
            # A cancellation that has nothing to do with the context's end is the caller's.
            if self._ok:
                raise
            raise self.end_error() from None
        finally:
            wait.cancel()  # it goes on after a timeout, or Ctrl-C
            with self._lock:
                self._waits = tuple(each for each in self._waits if each is not wait)

    def get_domain_id(self) -> int:
        """Return the domain of its nodes."""
        if not self._initialized:
            raise RuntimeError("Context must be initialized before it can have a domain id")
        return self.domain_id or 0

    def __enter__(self) -> Self:
        if not self._initialized:
            warnings.warn(
                "init() must be called on a Context before using it in a Python context manager."
                " Calling init() with no arguments, this usage is deprecated",
                stacklevel=2,
            )
            self.init()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.try_shutdown()


_lock: Final = threading.RLock()
_contexts: tuple[weakref.ref[Context], ...] = ()
"""Contexts that have been initialized. Replaced, never changed, so that every thread may read it."""
_watched: NodeThread | None = None
"""The thread whose end ends contexts."""
_exiting = False


def parsed_arguments(argv: Sequence[str]) -> RosArguments:
    """Return the ROS arguments of a command line; raise rclpy's errors for wrong ones."""
    try:
        return parse_ros_arguments(argv)
    except UnknownRosArgumentError as error:
        raise UnknownROSArgsError(str(error)) from error
    except InvalidRosArgumentError as error:
        raise RCLInvalidROSArgsError(str(error)) from error


def _thread_for(context: Context) -> NodeThread:
    """Return the thread for a context, which ends with the thread, or with the program."""
    global _contexts, _watched  # noqa: PLW0603 - the process's
    with _lock:
        _contexts = (*(each for each in _contexts if each() is not None), weakref.ref(context))
        # One thread for all contexts of the process: a thread and a loop for each would only cost switches
        # between them.
        thread = process_thread()
        if thread is not _watched:
            _watched = thread
            thread.ended.add_done_callback(_thread_ended)
            atexit.unregister(_end_all)
            atexit.register(_end_all)  # after the thread's own function, so that it is called before
    return thread


def initialized_contexts() -> Iterator[Context]:
    """Yield the contexts that have been initialized and are still referred to; in signal handlers, too."""
    for each in _contexts:
        context = each()
        if context is not None:
            yield context


def _thread_ended(ended: Reply[None]) -> None:
    for context in initialized_contexts():
        context.thread_ended(ended)


def _end_all() -> None:
    global _exiting  # noqa: PLW0603 - the process's
    _exiting = True
    for context in initialized_contexts():
        context.end()


def park_at_exit(*, pools_ended: bool = False) -> None:
    """While the program exits, block a daemon thread until Python kills it: what it uses is gone.

    Otherwise it would print a traceback after the program's own output.

    Args:
        pools_ended: Whether Python has ended the pools of threads, the first thing it does at exit.
    """
    if (_exiting or pools_ended) and threading.current_thread().daemon:
        threading.Event().wait()


def _after_fork_in_child() -> None:
    for context in initialized_contexts():
        context.forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)


def _call(callback: Any) -> None:
    """Call a function, or a method if its object is still there."""
    method = callback() if isinstance(callback, weakref.WeakMethod) else callback  # pyright: ignore[reportUnknownVariableType]
    if method is not None:
        method()
