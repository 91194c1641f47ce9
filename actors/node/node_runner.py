"""Runs a node: how it starts, what ends it, and how it stops.

Entering and leaving `async with node:` call `begin` and `end`. A node that stops calls no further callbacks,
but running callbacks may end, and calls and topics still work for them. Whatever callbacks do, `end` returns
within `stop_timeout_sec` and two seconds:

    running callbacks end, queued messages are sent     stop_timeout_sec for both
    remaining callbacks are cancelled                   GRACE_SEC, and as long for their remaining tasks
    callbacks that ignore that are logged and abandoned at once
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from typing import TYPE_CHECKING, Any, Final

from actors.callbacks.budget import CallbackBudget
from actors.callbacks.functions import exit_ends_node
from actors.errors import BrokerUnreachable, NodeAlreadyRunningError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator

    from actors.endpoints.context import NodeContext
    from actors.session.connector import Connector

STOP_TIMEOUT_SEC: Final = 5.0
"""How long a stopping node waits for running callbacks and for its queues: longer than nearly all callbacks
take, shorter than the ten seconds after which process managers kill."""

GRACE_SEC: Final = 1.0
"""How long to wait for cancelled callbacks, and then for the node's other tasks."""

_stop_limits: Final[dict[int, float]] = {}
"""`stop_timeout_sec` of the nodes that run in this process, by the ids of their runners."""


def longest_stop_sec() -> float:
    """Return the longest `stop_timeout_sec` of this process's running nodes; the default without any."""
    return max([*_stop_limits.values()], default=STOP_TIMEOUT_SEC)


class NodeRunner:
    """Starts and stops one node.

    Args:
        context: Shared by the node's parts.
        connector: Keeps the node's link connected.
        connect_timeout_sec: How long `begin` waits for a broker before it fails; None: see `begin`.
        stop_timeout_sec: How long `end` waits for running callbacks, and then for queued messages.
    """

    def __init__(
        self,
        context: NodeContext,
        connector: Connector,
        *,
        connect_timeout_sec: float | None,
        stop_timeout_sec: float,
    ) -> None:
        self._context = context
        self._connector = connector
        self._connect_timeout_sec = connect_timeout_sec
        self._stop_timeout_sec = stop_timeout_sec
        self._running = False
        # asyncio itself has only weak references to tasks; without this one they might be collected while
        # they run.
        self._tasks: dict[asyncio.Task[None], None] = {}
        self._body: asyncio.Task[Any] | None = None
        """The task that is inside `async with`."""
        self._cancelled_body: asyncio.Task[Any] | None = None
        self._cancelling = 0
        """How often the body's task had been asked to cancel when it entered."""
        self._leaving: asyncio.Task[None] | None = None
        """Sends the rest of a destroyed node and leaves the broker, while its body continues."""
        self._done: asyncio.Event | None = None
        self._failure: BaseException | None = None
        self._deadline = math.inf
        """Loop time when the current wait of stopping ends; `_force_stop` brings it forward."""
        self._letting_run = False
        """Whether it waits for callbacks that have not been cancelled."""
        self._force_stopped = False
        context.stop = self.fail

    async def begin(self) -> None:
        """Connect, and run callbacks as messages arrive.

        Returns when the node is in the broker's graph; without a broker when the first attempt to connect has
        failed or `FIRST_ANSWER_SEC` has passed, and goes on trying in the background. If the broker keeps the
        name for a silent node, it waits until that is decided.

        Raises:
            NodeAlreadyRunningError: It runs already.
            NodeDestroyed: It has been destroyed.
            BrokerUnreachable: No broker has accepted the node within `connect_timeout_sec`.
        """
        context, link = self._context, self._context.link
        if self._running:
            raise NodeAlreadyRunningError(f"Node '{context.full_name}' is running already")
        context.require_alive()
        # Before the first await, so that a second `async with` in another task finds it.
        self._running = True
        _stop_limits[id(self)] = self._stop_timeout_sec
        self._done = asyncio.Event()
        self._body = asyncio.current_task()
        # The body may be inside a timeout or a TaskGroup that has cancelled it already. Only what is added
        # from here on counts as a cancellation of this node's run.
        self._cancelling = self._body.cancelling() if self._body is not None else 0
        loop = link.run()
        connecting = self._spawn(self._keep_link())
        try:
            context.mailbox.on_exit = self.fail if exit_ends_node.get() else None
            # Before the first frame can arrive: the task that connects runs only when this one waits.
            context.mailbox.open(self._spawn, CallbackBudget.of(loop))
            # Without a broker, too: a control loop must not depend on whether somebody listens.
            for timer in context.timers:
                timer.start()
            timeout_sec = self._connect_timeout_sec
            if timeout_sec is None:
                await self._connector.first_attempt(
                    # A session that has ended again (the broker was shut down, say) is an answer, too. The
                    # connector goes on trying in the background.
                    lambda: self._entered() or (link.connections > 0 and not link.connected)
                )
                # A node that was frozen may still hold the name until its keepalive ends. Returning now
                # would let the first statement of the body run in a node that is then refused.
                while link.waits_for_name and not self._entered():
                    await link.changed()
                return
            self._deadline = loop.time() + timeout_sec
            while not (link.connections or self._entered()):
                await link.changed()  # the connector has the same deadline, and knows why there is no session
            if not await self._until(self._entered):
                connecting.cancel()  # stopping waits for nothing more from this broker
                how = "" if link.connected else "; it has closed the session"
                text = f"The broker at {link.url} has not accepted this node within {timeout_sec:g} s{how}"
                raise BrokerUnreachable(text)
        except BaseException as error:
            # Python does not call `__aexit__` when `__aenter__` raises, so what was started must be stopped
            # here.
            await self.end(error)
            raise

    def _entered(self) -> bool:
        """Whether entering is complete: the node is in the graph, or ends."""
        context = self._context
        return context.declared or context.destroyed or self._failure is not None

    def _spawn(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks[task] = None
        task.add_done_callback(self._task_ended)
        return task

    def _task_ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.pop(task, None)
        # SystemExit and KeyboardInterrupt have already ended the loop.
        if not task.cancelled() and isinstance(error := task.exception(), Exception):
            self._context.log.error("The node stops: a task of its own has failed", exc_info=error)
            self.fail(error)

    async def _keep_link(self) -> None:
        try:
            await self._connector.run(connect_timeout_sec=self._connect_timeout_sec)
        except CallboardError as error:
            self.fail(error)

    def sizes(self) -> Iterator[tuple[str, int]]:
        """Return how many tasks it holds."""
        yield "tasks", len(self._tasks)

    def fail(self, error: BaseException) -> None:
        """End the node with an error, which is raised where the node runs."""
        # The first error is the cause; those after it are mostly its consequences.
        if self._failure is None:
            self._failure = error
            self._context.link.wake()
            if self._done is not None:
                self._done.set()
            if self._body is not None:
                # The body may wait for anything, such as a socket of its own: cancelling is the only way to
                # end that wait.
                self._body.cancel()
                self._cancelled_body = self._body

    async def destroyed(self) -> None:
        """Wait until the node is destroyed; only while it runs."""
        assert self._done is not None
        await self._done.wait()

    async def end(self, error: BaseException | None) -> None:
        """Stop, as the module describes. If cancelled meanwhile, cancel callbacks at once.

        Args:
            error: The exception that ended the body. If the node has failed, its error is raised instead, but
                never instead of a cancellation by somebody else, which would be lost.
        """
        # From here on `fail` no longer cancels the task: it is busy with stopping the node.
        body, self._body = self._body, None
        if self._leaving is not None:
            self._leaving.cancel()  # `_stop` does the rest
        again: asyncio.CancelledError | None = None
        # In a task of its own, so that a cancellation of the body (a second Ctrl-C, a timeout around the
        # node) shortens the stop but does not leave it half done.
        stopping = asyncio.get_running_loop().create_task(self._stop())
        while not stopping.done():
            try:
                await asyncio.wait({stopping})
            except asyncio.CancelledError as cancelled:
                again = cancelled
                self._force_stop()
        self._running = False
        _stop_limits.pop(id(self), None)
        if self._cancelled_body is not None:
            # The cancellation was this node's own and ends here. Otherwise an enclosing `asyncio.timeout`
            # or TaskGroup would take it for one that came from outside.
            self._cancelled_body.uncancel()
        if not stopping.cancelled():
            stopping.result()
        cancellation = again or (error if isinstance(error, asyncio.CancelledError) else None)
        asked = body is not None and body.cancelling() > self._cancelling
        # A cancellation by somebody else goes first. Swallowing it would leave a task running that its
        # owner believes is cancelled.
        if cancellation is not None and (asked or self._failure is None):
            raise cancellation
        if self._failure is not None and (error is None or cancellation is error):
            raise self._failure

    async def _stop(self) -> None:
        context = self._context
        try:
            stopped_by = asyncio.get_running_loop().time() + self._stop_timeout_sec
            # The order matters. Callbacks first, since they may still publish and call; then the endpoints,
            # so that nothing new arrives; then the queues, which now can only get shorter.
            await self._end_callbacks(stopped_by)
            context.mailbox.close()
            self._destroy_parts()
            await self._empty_queues()
        finally:
            # Whatever has failed above: the socket is closed and every task ends.
            self._connector.abort()
            context.mailbox.close()
            context.destroyed = True
            context.link.thread = None
            context.clock.destroy()
            await self._end_tasks()

    async def _end_callbacks(self, stopped_by: float) -> None:
        """Call no further callbacks; wait for those that run, and cancel them in the end."""
        context, mailbox = self._context, self._context.mailbox
        context.stopping = True
        mailbox.drain(context.link.wake)
        for timer in tuple(context.timers):
            timer.cancel()
        # Retired, not destroyed: callbacks that still run may use them, but nothing new begins.
        for endpoint in tuple(context.endpoints):
            endpoint.retire()
        if context.unread:
            context.log.info(f"Stopping with {context.unread} received messages unread")
        if mailbox.running and not mailbox.cancelling:
            await self._let_run(stopped_by)
        loop = asyncio.get_running_loop()
        if mailbox.running:
            self._deadline = loop.time() + GRACE_SEC
            await self._until(lambda: not mailbox.running)
        # Callbacks may have used up all the time. The queue still gets a second, in which a healthy broker
        # takes everything.
        at_least = loop.time() + GRACE_SEC
        self._deadline = at_least if self._force_stopped else max(at_least, stopped_by)

    async def _let_run(self, until: float) -> None:
        """Wait for callbacks; cancel those that have not ended by then, or when stopping is forced."""
        log, mailbox = self._context.log, self._context.mailbox
        log.info(
            f"Stopping: up to {self._stop_timeout_sec:g} s for callbacks that run: {self._running_names}"
        )
        self._letting_run = True
        self._deadline = -math.inf if self._force_stopped else until
        if not await self._until(lambda: not mailbox.running):
            log.warning(f"Cancelling callbacks: {self._running_names}")
            mailbox.cancel_all()
        self._letting_run = False

    async def _empty_queues(self) -> None:
        """Wait until everything queued has been sent, and then leave the broker."""
        context, link, connector = self._context, self._context.link, self._connector

        def sent() -> bool:
            return link.sent and context.departing.empty

        # What the last loop turn has published is not in a queue yet.
        link.flush()
        # Without a session and without an attempt to get one, waiting cannot help.
        await self._until(lambda: sent() or not (link.connected or connector.trying))
        if not connector.closing:
            context.departing.report_unsent()
        connector.leave()
        await self._until(lambda: connector.ended)

    async def _until(self, condition: Callable[[], bool]) -> bool:
        """Wait until a condition on the link holds; return False if the deadline passes first."""
        loop = asyncio.get_running_loop()
        # Every change of the link wakes this: a message sent, a session ended, a callback finished
        # (`link.wake`).
        while not condition():
            if loop.time() >= self._deadline:
                return False
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(self._deadline):
                    await self._context.link.changed()
        return True

    def _force_stop(self) -> None:
        """Shorten the waits of stopping: cancel callbacks now."""
        self._force_stopped = True
        # Callbacks that have been cancelled already get the rest of their grace: a second cancellation
        # cannot hurry them.
        timeout = 0.0 if self._letting_run else GRACE_SEC
        self._deadline = min(self._deadline, asyncio.get_running_loop().time() + timeout)
        self._context.link.wake()

    async def _end_tasks(self) -> None:
        """Cancel every task. Callbacks that ignore that are logged and abandoned."""
        mailbox = self._context.mailbox
        # They have had `GRACE_SEC` in `_end_callbacks`. Waiting for them again would double the limit.
        waited_for = {each.task for each in tuple(mailbox.running) if each.holding or each.concurrent}
        for task in tuple(self._tasks):
            task.cancel()
        rest = [task for task in self._tasks if task not in waited_for]
        if rest:
            await asyncio.wait(rest, timeout=GRACE_SEC)
        if mailbox.running:
            self._context.log.error(
                f"Abandoning callbacks that ignore their cancellation: {self._running_names}"
            )

    @property
    def _running_names(self) -> str:
        return ", ".join(sorted({each.name for each in tuple(self._context.mailbox.running)}))

    def destroy(self) -> None:
        """Take everything out of service and cancel running callbacks at once. A second call does nothing.

        A running node leaves the broker after its messages have been sent, even if its body continues.
        """
        context, loop = self._context, self._context.link.loop
        if context.destroyed:
            return
        context.link.require_thread()
        # A node that does not run has no session to leave, and one that is stopping does it anyway.
        leaves = self._running and not context.stopping and loop is not None and loop.is_running()
        context.stopping = context.stopping or leaves
        self._destroy_parts()
        context.mailbox.cancel_all()
        context.destroyed = True
        context.clock.destroy()
        context.link.wake()
        if self._done is not None:
            self._done.set()
        if leaves and loop is not None:
            self._deadline = loop.time() + self._stop_timeout_sec
            # In the background: `destroy` is a plain function, and its caller is often a callback of this
            # node.
            self._leaving = self._spawn(self._empty_queues())

    def _destroy_parts(self) -> None:
        self._context.warnings.close()
        # A copy, as each removes itself from the original.
        for timer in tuple(self._context.timers):
            timer.destroy()
        for endpoint in tuple(self._context.endpoints):
            endpoint.destroy()
