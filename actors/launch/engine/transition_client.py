"""Requests transitions of lifecycle nodes, and follows them, with a hidden node.

The node is not that of the graph watch: it may be created late, for a lifecycle node that a function returns,
and a launch without such nodes needs no subscriptions.
"""

from __future__ import annotations

import asyncio
import math
from functools import partial
from typing import TYPE_CHECKING

from actors.interfaces.lifecycle_msgs.msg import Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.launch.planning.process_spec import MAX_PROCESSES
from actors.logging.logger import get_logger
from actors.logging.severity import LoggingSeverity
from actors.tools.hidden_node import make_hidden_node
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextvars import Context

    from actors.config.contexts import BrokerTarget
    from actors.endpoints.subscription.subscription import Subscription
    from actors.launch.engine.effects import RequestTransition
    from actors.launch.planning.process_spec import ProcessSpec
    from actors.node.node import Node


class TransitionClient:
    """The client of all lifecycle nodes of a launch, created in the event loop for the first one.

    If the broker is unreachable, or refuses the hidden node, requests fail and the launch goes on.

    Args:
        target: The broker, and the domain.
        name: The name of the hidden node.
        context: The context of the launch; tasks and callbacks run in copies of it.
        on_event: Called with the process of a watched node and each transition event of the node.
        on_answer: Called at the end of a request with None if the transition succeeded, otherwise with the
            reason, which is empty if the node has not given one.
    """

    def __init__(
        self,
        target: BrokerTarget,
        name: str,
        context: Context,
        *,
        on_event: Callable[[ProcessSpec, TransitionEvent], None],
        on_answer: Callable[[RequestTransition, str | None], None],
    ) -> None:
        self._target = target
        self._name = name
        self._context = context
        self._on_event = on_event
        self._on_answer = on_answer
        self._watched: dict[str, ProcessSpec] = {}
        """By the full names of their nodes, as `_subscriptions`."""
        self._subscriptions: dict[str, Subscription[TransitionEvent]] = {}
        self._requests: dict[RequestTransition, asyncio.Task[str | None]] = {}
        self._node: Node | None = None
        self._entered = asyncio.Event()
        self._problem = ""
        running = keep_running("The launch's client of lifecycle nodes", self._run)
        self._running = asyncio.create_task(running, name="launch lifecycle", context=context.copy())

    def watch(self, process: ProcessSpec) -> None:
        """Follow the transitions of the node of a process until the launch ends.

        Args:
            process: The process. Beyond `MAX_PROCESSES` nodes, the one that was watched first is dropped.
        """
        # The name stays watched after the end of the process: a restart has the same one.
        name = process.node or ""
        if name not in self._watched and len(self._watched) == MAX_PROCESSES:
            first = next(iter(self._watched))
            del self._watched[first]
            if (old := self._subscriptions.pop(first, None)) is not None:
                old.destroy()
        self._watched[name] = process
        self._context.copy().run(self._subscribe, name)

    def request(self, request: RequestTransition) -> None:
        """Request a transition; `on_answer` is called at its end.

        Args:
            request: The request.
        """
        task = asyncio.create_task(
            self._request(request), name=f"launch {request.label}", context=self._context.copy()
        )
        self._requests[request] = task
        task.add_done_callback(partial(self._ended, request))

    def cancel(self, request: RequestTransition) -> None:
        """Stop waiting for the end of a transition; `on_answer` is not called.

        Args:
            request: The request. One that has ended is ignored.
        """
        # Removed before it is cancelled: `_ended` reports only requests that are still in the table.
        if (task := self._requests.pop(request, None)) is not None:
            task.cancel()

    async def close(self) -> None:
        """Cancel all requests, and leave the broker. This takes two seconds at most."""
        for request in tuple(self._requests):
            self.cancel(request)
        await cancel_and_wait(self._running)

    async def _run(self) -> None:
        # `keep_running` runs this again after an unexpected error: with a new node, nothing is subscribed.
        self._entered.clear()
        self._node = node = make_hidden_node(self._name, url=self._target.url, domain=self._target.domain)
        # Errors only, such as refused endpoints: requests report that the broker is unreachable.
        node.get_logger().set_level(LoggingSeverity.ERROR)
        for name in self._watched:
            self._subscribe(name)
        try:
            async with node:
                self._entered.set()
                await asyncio.Event().wait()
        except CallboardError as error:
            self._problem = str(error)
            get_logger("launch").warning(f"cannot watch lifecycle nodes: {error}")
            self._entered.set()
        finally:
            self._node = None
            self._subscriptions.clear()

    def _subscribe(self, name: str) -> None:
        def on_transition(event: TransitionEvent) -> None:
            # Looked up now: a restart has replaced the process by another one of that name.
            if (process := self._watched.get(name)) is not None:
                self._on_event(process, event)

        if self._node is not None and name not in self._subscriptions:
            topic = f"{name}/transition_event"
            self._subscriptions[name] = self._node.create_subscription(TransitionEvent, topic, on_transition)

    async def _request(self, request: RequestTransition) -> str | None:
        limit = request.timeout_sec
        try:
            async with asyncio.timeout(None if math.isinf(limit) else limit):
                return await self._change_state(request)
        except TimeoutError:
            return f"no answer from '{request.node}/change_state' within {limit:g} s"
        except CallboardError as error:
            return str(error)

    async def _change_state(self, request: RequestTransition) -> str | None:
        # Until the node has entered, it is unknown whether the broker accepts it.
        await self._entered.wait()
        if self._node is None:
            return self._problem
        wanted = request.transition
        transition = Transition(id=wanted) if isinstance(wanted, int) else Transition(label=wanted)
        client = self._node.create_client(ChangeState, f"{request.node}/change_state")
        try:
            await client.wait_for_service(None)  # the request's own limit ends the wait
            response = await client.call(ChangeState.Request(transition=transition), None)
        finally:
            client.destroy()
        return None if response.success else ""

    def _ended(self, request: RequestTransition, task: asyncio.Task[str | None]) -> None:
        if self._requests.pop(request, None) is None:
            return  # it was cancelled
        error = asyncio.CancelledError() if task.cancelled() else task.exception()
        if error is not None:  # a bug
            get_logger("launch").error(f"Requesting a transition of {request.node} failed", exc_info=error)
        self._on_answer(request, task.result() if error is None else type(error).__name__)
