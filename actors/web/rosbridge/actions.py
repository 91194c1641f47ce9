"""The goals that one client sends, and the actions that it executes."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from actors.actions.names import ActionNames
from actors.actions.server_callbacks import CancelResponse
from actors.actions.states import GoalState
from actors.errors import GoalRejected, InvalidGoalTransitionError, ServiceUnavailable
from actors.interfaces.message import Action, type_name
from actors.web.calls import MATCH_SEC
from actors.web.goals import CANCEL_SEC
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.peer import full_name, full_type, require_room
from actors.web.rosbridge.values import arguments_by_name
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.actions.client import ActionClient
    from actors.actions.client_goal import ClientGoalHandle
    from actors.actions.server import ActionServer
    from actors.actions.server_goal import ServerGoalHandle
    from actors.web.rosbridge.operations import (
        ActionFeedback,
        ActionResult,
        AdvertiseAction,
        CancelActionGoal,
        Id,
        SendActionGoal,
        UnadvertiseAction,
    )
    from actors.web.rosbridge.peer import Peer

MAX_ACTIONS: Final = 100
"""Actions that a client executes."""


class _Sent:
    """A goal that the client has sent.

    Attributes:
        handle: The goal; None before the server has answered.
        canceled: Whether the client wants it to be cancelled.
    """

    def __init__(self) -> None:
        self.handle: ClientGoalHandle[Any, Any] | None = None
        self.canceled = False


class SentGoals:
    """The goals that one client has sent and that have not ended.

    Args:
        peer: The client.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._goals: dict[Id, _Sent] = {}

    async def send(self, request: SendActionGoal, size: int) -> None:
        """Send a goal; send its feedback and result to the client. It goes on if the client leaves.

        Args:
            request: The goal.
            size: The bytes of its frame.

        Raises:
            CallboardError: There is no server, it rejects the goal, or there is no result.
        """
        if request.id in self._goals:
            raise OperationError("A goal with this id has not ended")
        sent = _Sent()
        if request.id is not None:
            self._goals[request.id] = sent
        try:
            await self._follow(request, size, sent)
        finally:
            if request.id is not None:
                del self._goals[request.id]

    async def cancel(self, request: CancelActionGoal) -> None:
        """Request to cancel a goal.

        Raises:
            OperationError: There is none with this id.
            CallboardError: The server does not answer.
        """
        sent = self._goals.get(request.id)
        if sent is None:
            raise OperationError("There is no goal with this id that has not ended")
        sent.canceled = True
        if sent.handle is not None:
            await sent.handle.cancel(CANCEL_SEC)

    async def _follow(self, request: SendActionGoal, size: int, sent: _Sent) -> None:
        name, workspace = full_name(request.action), self._peer.workspace
        snapshot = await workspace.observer.newest_around(name)
        if not snapshot.count(EntryKind.SERVICE, ActionNames.of(name).send_goal):
            raise ServiceUnavailable(f"Action '{name}' has no server now")
        action_type: Any = await workspace.types.action(
            snapshot, name, full_type(request.action_type, "action")
        )
        values = arguments_by_name(action_type.Goal, request.args)
        goal = await self._peer.message(action_type.Goal, values, size)
        client: ActionClient[Any, Any, Any] = self._peer.node.create_action_client(action_type, name)
        try:
            if not await client.wait_for_server(MATCH_SEC):
                raise ServiceUnavailable(f"Action '{name}' has no complete server now")
            handle = sent.handle = await client.send_goal(goal)
            if not handle.accepted:
                raise GoalRejected(f"The server of '{name}' has rejected the goal")
            if sent.canceled:
                await handle.cancel(CANCEL_SEC)
            if request.feedback:
                async for feedback in handle:
                    await self._peer.send_later(
                        "action_feedback",
                        request.id,
                        {"values": await self._peer.values(feedback)},
                        like=request,
                        action=request.action,
                    )
            outcome = await handle.result(None)
        finally:
            client.destroy()
        self._peer.send(
            "action_result",
            request.id,
            {"values": await self._peer.values(outcome.result)},
            like=request,
            action=request.action,
            status=int(outcome.status),
            result=True,
        )


class _Running:
    """A goal that the client executes.

    Attributes:
        goal: The goal.
        outcome: How it ends: the state and the result; without a result it is aborted.
    """

    def __init__(self, goal: ServerGoalHandle[Any, Any, Any]) -> None:
        self.goal = goal
        self.outcome: asyncio.Future[tuple[int, Any]] = asyncio.get_running_loop().create_future()


@dataclass(slots=True)
class _Executed:
    """An action that the client executes.

    Attributes:
        server: Its server.
        goals: Those that have not ended, by the ids that the client has got.
    """

    server: ActionServer[Any, Any, Any]
    goals: dict[str, _Running] = field(default_factory=dict[str, _Running])


class ExecutedActions:
    """The actions that one client executes.

    Args:
        peer: The client.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._actions: dict[str, _Executed] = {}
        self._numbers = count(1)

    async def advertise(self, request: AdvertiseAction) -> None:
        """Execute the goals of an action, or replace the server that does.

        Raises:
            CallboardError: The type is not known, the name is not valid, or there are too many.
        """
        name = full_name(request.action)
        wanted = full_type(request.type, "action")
        action_type: Any = await self._peer.type_to_serve(Action, name, wanted)
        old = self._actions.pop(name, None)
        if old is not None:
            old.server.destroy()
        require_room(len(self._actions), MAX_ACTIONS, "actions")

        async def execute(goal: ServerGoalHandle[Any, Any, Any]) -> Any:
            return await self._execute(request.action, executed, goal)

        async def cancel(goal: ServerGoalHandle[Any, Any, Any]) -> CancelResponse:
            return self._cancel(request.action, executed, goal)

        server = self._peer.node.create_action_server(action_type, name, execute, cancel_callback=cancel)
        executed = self._actions[name] = _Executed(server)
        try:
            await self._peer.require_accepted(server)
        except OperationError:
            del self._actions[name]
            raise

    def unadvertise(self, request: UnadvertiseAction) -> None:
        """Execute an action no longer; its goals end without results.

        Raises:
            OperationError: The client does not execute it.
        """
        executed = self._actions.pop(full_name(request.action), None)
        if executed is None:
            raise OperationError(f"This client has not advertised the action '{request.action}'")
        executed.server.destroy()

    async def publish_feedback(self, feedback: ActionFeedback, size: int) -> None:
        """Publish feedback.

        Args:
            feedback: The feedback.
            size: The bytes of its frame.

        Raises:
            CallboardError: There is no such goal, or the values do not fit.
        """
        executed, running = self._goal(feedback)
        action_type: Any = executed.server.action_type
        running.goal.publish_feedback(await self._peer.message(action_type.Feedback, feedback.values, size))

    async def finish(self, result: ActionResult, size: int) -> None:
        """End a goal.

        Args:
            result: Its result.
            size: The bytes of its frame.

        Raises:
            CallboardError: There is no such goal, or the values do not fit; then the goal is aborted.
        """
        executed, running = self._goal(result)
        message, values = None, result.values
        action_type: Any = executed.server.action_type
        try:
            if result.result and not isinstance(values, str):
                by_name = arguments_by_name(action_type.Result, values)
                message = await self._peer.message(action_type.Result, by_name, size)
        finally:
            if not running.outcome.done():
                running.outcome.set_result((result.status, message))

    def _goal(self, about: ActionFeedback | ActionResult) -> tuple[_Executed, _Running]:
        executed = self._actions.get(full_name(about.action))
        running = None if executed is None else executed.goals.get(str(about.id))
        if executed is None or running is None:
            raise OperationError(f"'{about.action}' has no goal with this id that this client executes")
        return executed, running

    async def _execute(self, text: str, executed: _Executed, goal: ServerGoalHandle[Any, Any, Any]) -> Any:
        id_ = f"action_goal:{text}:{next(self._numbers)}"
        running = executed.goals[id_] = _Running(goal)
        action_type: Any = executed.server.action_type
        try:
            self._peer.send(
                "send_action_goal",
                id_,
                {"args": await self._peer.values(goal.request)},
                action=text,
                action_type=type_name(action_type),
                feedback=True,
            )
            status, result = await running.outcome
        finally:
            del executed.goals[id_]
        ends: dict[int, Callable[[], None]] = {
            GoalState.SUCCEEDED: goal.succeed,
            GoalState.CANCELED: goal.canceled,
        }
        end = goal.abort if result is None else ends.get(status, goal.abort)
        try:
            end()
        except InvalidGoalTransitionError:  # CANCELED, although nobody has asked for it
            goal.abort()
        return action_type.Result() if result is None else result

    def _cancel(
        self, text: str, executed: _Executed, goal: ServerGoalHandle[Any, Any, Any]
    ) -> CancelResponse:
        for id_, running in executed.goals.items():
            if running.goal is goal:
                self._peer.send("cancel_action_goal", id_, action=text)
        return CancelResponse.ACCEPT
