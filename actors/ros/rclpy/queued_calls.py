"""Calls that the loop wants made where the executor spins, and answers for the loop."""

from __future__ import annotations

import asyncio
import inspect
from collections import deque
from concurrent.futures import CancelledError
from functools import partial
from typing import TYPE_CHECKING, Any

from actors.callbacks.callback_task import current_callback_task
from actors.ros.rclpy.entity import Entity
from actors.ros.rclpy.task import Future
from actors.threads.errors import ThreadStopped

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from concurrent.futures import Future as Reply

    from actors.callbacks.callback_task import CallbackTask
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.threads.node_thread import NodeThread


class QueuedCalls(Entity):
    """Calls that wait for the executor. The callers of `enqueue` limit their number.

    Args:
        thread: The thread of the loop.
        callback_group: When the calls may be made.
    """

    def __init__(self, thread: NodeThread, callback_group: CallbackGroup) -> None:
        super().__init__(callback_group)
        self._thread = thread
        self._calls: deque[Callable[[], Any]] = deque()
        self._unanswered: dict[asyncio.Future[Any], CallbackTask | None] = {}
        """Answers that the loop waits for, with the callback tasks of callboard's node that do."""
        self._given_up = False

    def enqueue(self, call: Callable[[], Any]) -> None:
        """Make a call soon; in any thread."""
        self._calls.append(call)
        self.notify()

    def has_work(self) -> bool:
        """Return whether a call waits."""
        return bool(self._calls)

    def take(self) -> Callable[[], Any] | None:
        """Return the next call."""
        return self._calls.popleft() if self._calls else None

    def answer_of(self, callback: Callable[..., Any], *args: Any) -> asyncio.Future[Any]:
        """Make a call where the executor spins, and return the future of its result; in the loop.

        If it raises, spinning raises the error, and the future has it.
        """
        return self._enqueue_answered(partial(self._serve, callback, args))

    async def run(self, callback: Callable[..., Any], *args: Any) -> Any:
        """Do the same, and wait for the result."""
        return await self.answer_of(callback, *args)

    async def run_task(self, callback: Callable[..., Any], *args: Any) -> Any:
        """Make a call as a task of the executor, outside the callback group.

        If it raises, this does, and spinning goes on.
        """
        return await self._enqueue_answered(partial(self._create_task, callback, args))

    def _enqueue_answered(self, call: Callable[[asyncio.Future[Any]], Any]) -> asyncio.Future[Any]:
        answer: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        # With the callback task of callboard's node, since that task and not the future is what a stopping
        # node waits for.
        self._unanswered[answer] = current_callback_task.get()
        answer.add_done_callback(self._unanswered.pop)
        if self._given_up:
            self._cancel_answer(answer)
        else:
            self.enqueue(partial(call, answer))
        return answer

    def give_up(self) -> None:
        """Cancel all waits for answers, later ones, too: no executor will make the calls. In the loop."""
        self._given_up = True
        for answer in tuple(self._unanswered):
            self._cancel_answer(answer)

    def _cancel_answer(self, answer: asyncio.Future[Any]) -> None:
        """Cancel the callback task that waits for an answer, or the answer if there is no task."""
        task = self._unanswered.get(answer)
        if answer.done():  # the task will read it in this loop turn
            return
        if task is None:
            answer.cancel()
        else:
            task.cancel()

    def _create_task(self, callback: Callable[..., Any], args: Any, answer: asyncio.Future[Any]) -> None:
        executor = self.active_executor
        if executor is None:  # the node was removed from the one that makes this call
            self.enqueue(partial(self._create_task, callback, args, answer))
            return

        async def work() -> None:
            try:
                result = callback(*args)
                if inspect.iscoroutine(result):
                    result = await result
            except Exception as error:  # noqa: BLE001 - the user's: raised where `run_task` was called
                self._answer(answer, None, error)
            except BaseException as error:  # such as KeyboardInterrupt, which is for the thread that spins
                self._answer(answer, None, error)
                raise
            else:
                self._answer(answer, result, None)

        if not answer.done():
            executor.create_task(work)

    def _serve(self, callback: Callable[..., Any], args: Any, answer: asyncio.Future[Any]) -> Any:
        if answer.done():  # its wait was cancelled
            return None
        try:
            result = callback(*args)
        except BaseException as error:
            self._answer(answer, None, error)
            raise
        if inspect.iscoroutine(result):
            return self._serve_later(answer, result)
        self._answer(answer, result, None)
        return None

    async def _serve_later(self, answer: asyncio.Future[Any], coroutine: Coroutine[Any, Any, Any]) -> None:
        try:
            result = await coroutine
        except BaseException as error:
            self._answer(answer, None, error)
            raise
        self._answer(answer, result, None)

    def _answer(self, answer: asyncio.Future[Any], result: Any, error: BaseException | None) -> None:
        try:
            # Futures of asyncio may only be completed in their loop, and this runs in the thread that
            # spins.
            self._thread.post(self._set_answer, answer, result, error)
        except ThreadStopped:  # the program ends, and so has the wait
            return

    def _set_answer(self, answer: asyncio.Future[Any], result: Any, error: BaseException | None) -> None:
        if answer.done():
            return
        if error is None:
            answer.set_result(result)
        elif isinstance(error, Exception):
            answer.set_exception(error)
        else:  # such as KeyboardInterrupt: no error of the callback
            self._cancel_answer(answer)

    def start(self, work: Callable[[], Coroutine[Any, Any, Any]]) -> Future[Any]:
        """Run a coroutine in the loop.

        Args:
            work: Returns the coroutine.

        Returns:
            A future, which the executor completes. If it is cancelled, so is the coroutine.
        """
        future: Future[Any] = Future()
        # Two futures for one call: the loop completes `reply` in its own thread, but rclpy promises that a
        # future is completed where the executor spins.
        reply = self._thread.submit(work)
        future.when_done(lambda: future.cancelled() and reply.cancel())
        reply.add_done_callback(lambda reply: self.enqueue(lambda: self._replied(future, reply)))
        return future

    def _replied(self, future: Future[Any], reply: Reply[Any]) -> None:
        if future.done():
            return
        future.set_executor(self.active_executor)
        try:
            error = reply.exception()
        except CancelledError:
            future.cancel()
            return
        if error is None:
            future.set_result(reply.result())
        else:
            future.set_exception(error)


class RecentCalls:
    """Calls of an entity that wait for the executor, up to a limit; beyond it the oldest is dropped.

    Args:
        entity: Makes the calls.
        depth: How many may wait.

    Attributes:
        dropped: How many have been dropped.
    """

    def __init__(self, entity: QueuedCalls, depth: int) -> None:
        self.dropped = 0
        self._entity = entity
        self._depth = depth
        self._calls: deque[Callable[[], Any]] = deque()
        """As many as there are calls of `_make` in the entity's queue."""

    def add(self, call: Callable[[], Any]) -> None:
        """Make a call soon; in the loop."""
        self._calls.append(call)
        if len(self._calls) > self._depth:
            oldest = self._calls.popleft()
            if oldest is not call:  # its `_make` will make another one of these
                self.dropped += 1
                return
            self._calls.append(call)  # the executor has just made the others
        self._entity.enqueue(self._make)

    def _make(self) -> Any:
        return self._calls.popleft()()
