"""The thread of nodes as users hold it."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, overload

from actors.errors import WaitTimeout
from actors.interfaces.message import Message
from actors.threads.contexts import Contexts
from actors.threads.errors import ThreadStopped
from actors.threads.loop_thread import STOP_TIMEOUT_SEC, LoopThread
from actors.threads.publisher import QUEUED_MESSAGES, ThreadPublisher
from proto.errors import CallboardError

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from collections.abc import Callable, Coroutine
    from concurrent.futures import Future
    from contextlib import AbstractAsyncContextManager
    from types import TracebackType

    from actors.endpoints.publisher.publisher import Publisher
    from actors.threads.contexts import HeldContext

T = TypeVar("T")
MessageT = TypeVar("MessageT", bound=Message)


class NodeThread:
    """Runs nodes in a thread with an event loop of its own, for programs without asyncio.

        with NodeThread() as thread:
            node = thread.enter(actors.Node("panel"))
            print(thread.call(node.get_node_names))

    Its methods may be called from any thread, except that `call`, `enter`, `leave` and `stop` raise
    RuntimeError in the loop's own, where they would wait for themselves. Use nodes and their endpoints before
    `enter`, in callbacks, and otherwise through `call`, `submit` and `publisher`; only `Subscription.take`
    works in every thread.

    If a node fails after it was entered, the thread ends: the other nodes are left, calls raise
    ThreadStopped, and `stop` raises the error. A thread that runs when the program ends is stopped then.

    Args:
        name: The thread's name.
        loop_factory: Makes the event loop; None: uvloop's, if it is installed.
    """

    def __init__(
        self,
        name: str = "callboard-nodes",
        *,
        loop_factory: Callable[[], AbstractEventLoop] | None = None,
    ) -> None:
        # `_failed` is a method because each of the two needs the other: contexts report to the thread, and
        # the thread leaves the contexts when it ends.
        self._contexts = Contexts(self._failed)
        self._thread = LoopThread(name, loop_factory, self._contexts.leave_all)

    def _failed(self, error: BaseException) -> None:
        self._thread.fail(error)

    @property
    def ended(self) -> Future[None]:
        """A future that is done when the thread ends; it has the error if the thread failed."""
        return self._thread.ended

    def start(self) -> Self:
        """Start the thread. Use `with` where possible: it stops the thread as well.

        Returns:
            This object.

        Raises:
            RuntimeError: It has been started before.
        """
        self._thread.start()
        return self

    def stop(self, timeout_sec: float = STOP_TIMEOUT_SEC) -> None:
        """Stop the thread. A second call does nothing more.

        Calls that run are cancelled and raise ThreadStopped. What was published is sent, and the nodes
        are left in reverse order, each within its `stop_timeout_sec`, as at the end of `async with node:`.

        Args:
            timeout_sec: Seconds to wait at most for the end of the thread.

        Raises:
            WaitTimeout: The thread still runs; only a callback that blocks it can cause that.
            RuntimeError: This is the loop's own thread.
            Exception: The error with which a node failed.
        """
        self._thread.stop(timeout_sec)

    def __enter__(self) -> Self:
        """Start the thread."""
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> Literal[False]:
        """Stop the thread, as `stop` does; raise the error of a node, but not instead of another error."""
        # ThreadStopped in the body is only the consequence of the failure: the cause replaces it. Any
        # other error of the body is the program's own, and must not be hidden.
        failure = self._thread.join()
        if failure is not None and (error is None or isinstance(error, ThreadStopped)):
            raise failure
        return False

    def enter(self, context: AbstractAsyncContextManager[T], timeout_sec: float | None = None) -> T:
        """Enter a node, or another asynchronous context manager such as a broker.

        Args:
            context: The node. It is left by `leave`, or when the thread stops.
            timeout_sec: Seconds to wait at most; None: as long as it takes, for nodes about a second.

        Returns:
            What `async with` gives: the node.

        Raises:
            BrokerUnreachable, NodeNameTaken, NodeDestroyed: As for `async with node:`.
            NodeAlreadyRunningError: As for `async with node:`.
            WaitTimeout: It was not entered within `timeout_sec`, and is being left again.
            ThreadStopped: The thread does not run, or ends meanwhile.
            RuntimeError: This is the loop's own thread.
        """
        began: list[HeldContext] = []
        try:
            value: T = self._thread.call(self._contexts.enter(context, began.append), timeout_sec)
        except (WaitTimeout, KeyboardInterrupt):
            for held in began:  # the cancellation has come too late if it was being entered just now
                with suppress(CallboardError):
                    self._thread.submit(held.leave)
            raise
        return value

    def leave(self, context: AbstractAsyncContextManager[Any]) -> None:
        """Leave a node, as at the end of `async with node:`; return when it is left.

        Args:
            context: The context, or its value, as `enter` returned it.

        Raises:
            LookupError: It is not entered in this thread.
            ThreadStopped: The thread does not run, or ends meanwhile.
            RuntimeError: This is the loop's own thread.
            Exception: The error with which the node ends.
        """
        self._thread.call(self._contexts.leave(context), None)

    def leave_soon(self, context: AbstractAsyncContextManager[Any]) -> None:
        """Leave a node without waiting for it, in any thread, in finalizers, too.

        An error of its end ends the thread. It is none if the node is not entered.

        Args:
            context: As for `leave`.

        Raises:
            ThreadStopped: The thread does not run.
        """
        self._thread.post(self._contexts.leave_soon, context)

    @overload
    def call(self, work: Coroutine[Any, Any, T], timeout_sec: float | None = ...) -> T: ...

    @overload
    def call(self, work: Callable[[], Coroutine[Any, Any, T]], timeout_sec: float | None = ...) -> T: ...

    @overload
    def call(self, work: Callable[[], T], timeout_sec: float | None = ...) -> T: ...

    def call(self, work: Any, timeout_sec: float | None = None) -> Any:
        """Run a coroutine or a function in the loop, and block until it has ended.

        When the time is over, and when this thread is interrupted by Ctrl-C, it is cancelled.

        Args:
            work: A coroutine, such as `client.call(request)`; or a function without arguments, such as
                `node.get_graph` or a lambda. A coroutine that the function returns is awaited.
            timeout_sec: Seconds to wait at most; None: until it ends. callboard's own waits and calls have
                deadlines.

        Returns:
            Its result.

        Raises:
            WaitTimeout: It did not end within `timeout_sec`.
            ThreadStopped: The thread does not run, or ends meanwhile.
            TooManyCalls: 100,000 calls have not ended.
            TypeError: It is neither, such as the result of a function that has run in this thread.
            RuntimeError: This is the loop's own thread, where it would wait for itself.
            CallCancelled: The coroutine was cancelled in the loop.
            Exception: Its exception.
        """
        return self._thread.call(work, timeout_sec)

    @overload
    def submit(self, work: Coroutine[Any, Any, T]) -> Future[T]: ...

    @overload
    def submit(self, work: Callable[[], Coroutine[Any, Any, T]]) -> Future[T]: ...

    @overload
    def submit(self, work: Callable[[], T]) -> Future[T]: ...

    def submit(self, work: Any) -> Future[Any]:
        """Run a coroutine or a function in the loop, without waiting for it.

        Args:
            work: As for `call`.

        Returns:
            Its future. `cancel()` cancels the coroutine. It has ThreadStopped if the thread ends before
            the coroutine, and CallCancelled if the coroutine is cancelled in the loop.

        Raises:
            TypeError: As for `call`.
            ThreadStopped: The thread does not run.
            TooManyCalls: 100,000 calls have not ended.
        """
        return self._thread.submit(work)

    def post(self, callback: Callable[..., object], *args: object) -> None:
        """Call a function in the loop, after those posted before, without a result. The cheapest way there.

        Args:
            callback: A plain function that does not block. If it raises, the loop logs the error.
            args: Its arguments.

        Raises:
            ThreadStopped: The thread does not run.
        """
        self._thread.post(callback, *args)

    def publisher(
        self, publisher: Publisher[MessageT], limit: int = QUEUED_MESSAGES
    ) -> ThreadPublisher[MessageT]:
        """Make a publisher of a node in this thread usable in all threads.

        Args:
            publisher: The publisher.
            limit: Messages that may wait for the loop, at least 1; not more than 64 MiB in any case.

        Returns:
            An object whose `publish` may be called in any thread.

        Raises:
            ValueError: The limit is below 1.
        """
        return ThreadPublisher(self._thread, publisher, limit)
