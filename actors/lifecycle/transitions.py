"""Runs the transitions of a node, and serves them to other nodes: ROS 2's five services and one topic.

A transition runs to its end once it has begun, even if the caller of `change_state` gives up. It does not
hold the mailbox: while a coroutine callback waits, the node's other callbacks run, `get_state` is answered,
and other transitions are refused.
"""

from __future__ import annotations

import asyncio
import inspect
from typing import TYPE_CHECKING

from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM
from actors.endpoints.context import in_flight
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.service.idle import IdleService
from actors.errors import NodeDestroyed
from actors.interfaces.lifecycle_msgs import msg, srv
from actors.lifecycle.errors import InvalidTransitionError
from actors.lifecycle.publisher import Activation
from actors.lifecycle.requests import StateRequests, transition_event
from actors.lifecycle.states import ACTIVE, CALLBACKS, StateMachine, TransitionCallbackReturn

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.endpoints.publisher.publisher import Publisher
    from actors.lifecycle.states import LifecycleState, Transition
    from actors.node.node import Node


class Transitions:
    """The state of a node, and what changes it.

    Args:
        node: The node; its methods are the callbacks.
        context: The node's context.

    Attributes:
        machine: The state machine.
        activation: Whether lifecycle publishers publish.
    """

    def __init__(self, node: Node, context: NodeContext) -> None:
        self.machine = StateMachine()
        self.activation = Activation()
        self._node = node
        self._context = context
        self._timing = context.watch.of(self._run, "a lifecycle transition")
        self._events: Publisher[msg.TransitionEvent] | None = None

    def serve(self) -> None:
        """Let other nodes request transitions and watch them."""
        node = self._node
        self._events = node.create_publisher(msg.TransitionEvent, "~/transition_event")
        endpoint_of(self._events).standard = True
        for name, kind, callback in (
            ("change_state", srv.ChangeState, self._change_state),
            *StateRequests(self.machine).handlers(),
        ):
            full_name = node.resolve_service_name(f"~/{name}")
            IdleService(self._context, kind, full_name, callback=callback, concurrent=True)

    async def request(self, wanted: int | str) -> TransitionCallbackReturn:
        """Begin a transition, and wait for its end.

        Args:
            wanted: Its number or label.

        Returns:
            What its callback has returned.

        Raises:
            InvalidTransitionError: It is not possible now.
            RuntimeError: The node does not run.
            NodeDestroyed: The node was destroyed before the end.
        """
        context = self._context
        context.require_loop()
        start = self.machine.current
        # The state changes before the callback task exists, so that a second request in between is refused.
        self._publish(self.machine.request(wanted))
        results: list[TransitionCallbackReturn | None] = []

        def ended(result: TransitionCallbackReturn | None, error: BaseException | None) -> None:
            del error  # the node has cancelled it
            results.append(result)
            context.link.wake()

        # A task of the node, not of the caller: a caller that is cancelled must not leave a node half
        # configured.
        context.mailbox.run_concurrently(CallbackTask(context.mailbox, self._run(start), ended, self._timing))
        with in_flight():
            # A stopped node runs no callbacks, so that `ended` may never be called.
            while not (results or context.mailbox.closed):
                await context.link.changed()
        if not results or results[0] is None:
            raise NodeDestroyed(f"Node '{context.full_name}' was stopped during a transition")
        return results[0]

    async def _run(self, start: LifecycleState) -> TransitionCallbackReturn:
        result = await self._call_back(start)
        self._finish(result)
        if result is TransitionCallbackReturn.ERROR:
            # `on_error` runs in the state ERRORPROCESSING, which `_finish` has just entered. If it fails as
            # well, the table leads to finalized: there is no second attempt.
            self._finish(await self._call_back(start))
        return result

    async def _call_back(self, start: LifecycleState) -> TransitionCallbackReturn:
        """Run the callback of the current state; return ERROR if it raises."""
        name = CALLBACKS[self.machine.current]
        try:
            result = getattr(self._node, name)(start)
            if inspect.isawaitable(result):
                result = await result
            if not isinstance(result, TransitionCallbackReturn):
                raise TypeError(f"it returned {result!r}, not a TransitionCallbackReturn")
        except (*ENDS_PROGRAM, GeneratorExit):  # the last: the loop has closed
            raise
        except BaseException as error:
            # The node is stopping, which is no failure of the callback.
            if isinstance(error, asyncio.CancelledError) and self._context.mailbox.cancelling:
                raise
            self._context.callback_failed(name, error)
            return TransitionCallbackReturn.ERROR
        return result

    def _finish(self, result: TransitionCallbackReturn) -> None:
        transition = self.machine.finish(result)
        # From the state and not from the callbacks: an overridden `on_activate` need not call the base's.
        self.activation.active = self.machine.current == ACTIVE
        self._publish(transition)

    def _publish(self, transition: Transition) -> None:
        if self._events is not None and not self._events.destroyed:
            self._events.publish(transition_event(transition, self._node.get_clock().now().nanoseconds))

    async def _change_state(self, request: srv.ChangeState.Request) -> srv.ChangeState.Response:
        wanted = request.transition
        try:
            # The label goes first, as in ROS 2: "shutdown" has another number in each state.
            result = await self.request(wanted.label or wanted.id)
        except InvalidTransitionError as error:
            if self._context.may_log("refused transitions"):
                self._context.log.warning(str(error))
            return srv.ChangeState.Response(success=False)
        return srv.ChangeState.Response(success=result is TransitionCallbackReturn.SUCCESS)
