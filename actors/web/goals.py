"""Sends goals for browsers and programs, and follows them. A goal goes on when its sender has gone."""

from __future__ import annotations

import asyncio
import uuid
from collections import deque
from typing import TYPE_CHECKING, Any, Final

from actors.actions.names import ActionNames
from actors.errors import GoalRejected, GoalUnknown, ServiceOverloaded, ServiceUnavailable
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.time.timeout import DEFAULT_TIMEOUT
from actors.web.calls import MATCH_SEC, message_of
from proto.aio.tasks import cancel_and_wait
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.actions.client import ActionClient
    from actors.actions.client_goal import ClientGoalHandle, GoalResult
    from actors.interfaces.message import Message
    from actors.tools.graph_types import GraphTypes
    from actors.web.observer import Observer

MAX_GOALS: Final = 64
"""Goals that are followed at the same time."""

KEPT_FEEDBACK: Final = 20
"""Feedback messages of one goal that wait for its reader; then the oldest makes room."""

CANCEL_SEC: Final = 5.0
"""Time for the answer to a cancellation."""


class FollowedGoal:
    """A goal, its newest feedback and its end.

    Args:
        action: The action's full name.

    Attributes:
        action: The action's full name.
        uuid: The goal's id.
        goal_id: The same as 32 hex digits.
        read: Whether a stream reads it.
        handle: The goal; None before the server has answered.
        outcome: The result; None before the end, and after an error.
        error: Why there will be no result.
        skipped: Feedback that has made room since this was set to 0.
        news: Set when there is feedback, or the goal has ended.
        decided: Set when the server has answered, or will not.
        ended: Whether nothing more will come.
    """

    def __init__(self, action: str) -> None:
        self.action = action
        self.uuid = UUID(uuid=uuid.uuid4().bytes)
        self.goal_id = bytes(self.uuid.uuid).hex()
        self.read = True
        self.handle: ClientGoalHandle[Any, Any] | None = None
        self.outcome: GoalResult[Any] | None = None
        self.error: CallboardError = GoalUnknown("The web server follows this goal no longer")
        self.skipped = 0
        self.news = asyncio.Event()
        self.decided = asyncio.Event()
        self.ended = False
        self._feedback: deque[Any] = deque(maxlen=KEPT_FEEDBACK)

    def document(self) -> dict[str, Any]:
        """Return the goal as JSON: goal_id, status."""
        return {"goal_id": self.goal_id, "status": self.handle.status.name if self.handle else "UNKNOWN"}

    def add_feedback(self, message: Any) -> None:
        """Keep a feedback message."""
        self.skipped += len(self._feedback) == KEPT_FEEDBACK
        self._feedback.append(message.feedback)
        self.news.set()

    def pop_feedback(self) -> list[Message]:
        """Return the feedback that has come since the last call."""
        taken = [*self._feedback]
        self._feedback.clear()
        return taken

    async def accepted(self) -> None:
        """Wait for the server's answer.

        Raises:
            GoalRejected: The server has rejected the goal.
            CallFailed: There was no answer.
        """
        await self.decided.wait()
        if self.handle is None or not self.handle.accepted:
            raise self.error


class Goals:
    """The goals that the web server has sent and that have not ended.

    Args:
        observer: Has the node that sends them, and the graph.
        types: The graph's classes.
    """

    def __init__(self, observer: Observer, types: GraphTypes) -> None:
        self._observer, self._node = observer, observer.node
        self._types = types
        self._goals: dict[str, tuple[FollowedGoal, asyncio.Task[None]]] = {}
        """By id, the oldest first."""
        self._cancellations: set[asyncio.Task[None]] = set()

    async def send(
        self, action: str, values: Mapping[str, Any], wanted: str, timeout_sec: float | None
    ) -> FollowedGoal:
        """Send a goal, and follow it until its end.

        Args:
            action: The action's full name.
            values: The fields of the goal.
            wanted: The type's name, needed if the graph has several; else empty.
            timeout_sec: For the server's answer; None is the node's default.

        Raises:
            RequestError: The values do not fit.
            ServiceUnavailable: There is no server.
            ServiceOverloaded: `MAX_GOALS` are being read.
            UnknownInterfaceError, InvalidMessageError: See `GraphTypes`.
            BrokerUnreachable: There is no broker now.
        """
        snapshot = await self._observer.newest_around(action)
        if not snapshot.count(EntryKind.SERVICE, ActionNames.of(action).send_goal):
            raise ServiceUnavailable(f"Action '{action}' has no server now")
        action_type: Any = await self._types.action(snapshot, action, wanted)
        message = await self._observer.work.run(message_of, action_type.Goal, values)
        self._make_room()
        goal = FollowedGoal(action)
        client: ActionClient[Any, Any, Any] = self._node.create_action_client(action_type, action)
        task = asyncio.get_running_loop().create_task(self._follow(goal, client, message, timeout_sec))
        self._goals[goal.goal_id] = goal, task
        return goal

    def of_action(self, action: str) -> list[FollowedGoal]:
        """Return the goals of an action, the oldest first."""
        return [goal for goal, _ in self._goals.values() if goal.action == action]

    def find(self, action: str, goal_id: str) -> FollowedGoal | None:
        """Return a goal; None if it has ended, or is not from here."""
        goal, _ = self._goals.get(goal_id, (None, None))
        return goal if goal is not None and goal.action == action else None

    async def cancel(self, goal: FollowedGoal) -> bool:
        """Request to cancel a goal; return whether the server agrees.

        Raises:
            GoalRejected: The server has rejected the goal.
            CallFailed: There was no answer.
        """
        await goal.accepted()
        assert goal.handle is not None
        return bool((await goal.handle.cancel(CANCEL_SEC)).goals_canceling)

    def cancel_later(self, goal: FollowedGoal) -> None:
        """Request to cancel a goal whose reader has gone."""
        task = asyncio.get_running_loop().create_task(self._cancel_quietly(goal))
        self._cancellations.add(task)
        task.add_done_callback(self._cancellations.discard)

    async def close(self) -> None:
        """Stop following all goals; they go on at their servers."""
        for task in [*self._cancellations, *(task for _, task in self._goals.values())]:
            await cancel_and_wait(task)

    async def _cancel_quietly(self, goal: FollowedGoal) -> None:
        try:
            await self.cancel(goal)
        except CallboardError as error:  # nobody waits for the answer
            self._node.get_logger().warning(f"A goal of '{goal.action}' was not cancelled: {error}")

    async def _follow(
        self,
        goal: FollowedGoal,
        client: ActionClient[Any, Any, Any],
        message: Message,
        timeout_sec: float | None,
    ) -> None:
        try:
            if not await client.wait_for_server(MATCH_SEC):
                raise ServiceUnavailable(f"Action '{goal.action}' has no complete server now")
            limit = DEFAULT_TIMEOUT if timeout_sec is None else timeout_sec
            goal.handle = await client.send_goal(message, goal.add_feedback, goal.uuid, timeout_sec=limit)
            if not goal.handle.accepted:
                raise GoalRejected(f"The server of '{goal.action}' has rejected the goal")
            goal.decided.set()
            goal.outcome = await goal.handle.result(None)
        except CallboardError as error:
            goal.error = error
        finally:
            goal.ended = True
            goal.decided.set()
            goal.news.set()
            self._goals.pop(goal.goal_id, None)
            client.destroy()

    def _make_room(self) -> None:
        """Stop following the oldest goal without a reader if there are too many.

        Raises:
            ServiceOverloaded: All are being read.
        """
        if len(self._goals) < MAX_GOALS:
            return
        for goal, task in self._goals.values():
            if not goal.read:
                del self._goals[goal.goal_id]
                task.cancel()
                return
        raise ServiceOverloaded(f"{MAX_GOALS} goals of this web server are in flight already; cancel one")
