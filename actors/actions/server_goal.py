"""A goal as the callbacks of an action server hold it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from actors.actions.states import GoalEvent, GoalState, next_state
from actors.interfaces.message import Message

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.callbacks.callback_task import CallbackTask
    from actors.interfaces.action_msgs.msg import GoalInfo
    from actors.interfaces.unique_identifier_msgs.msg import UUID

GoalT = TypeVar("GoalT", bound=Message)
ResultT = TypeVar("ResultT", bound=Message)
FeedbackT = TypeVar("FeedbackT", bound=Message)


class GoalOwner(Protocol):
    """The part of an action server that its goals use."""

    def execute(self, goal: GoalProgress, callback: Callable[..., Any] | None) -> None:
        """Start the execute callback."""
        ...

    def publish_feedback(self, goal: GoalProgress, feedback: Any) -> None:
        """Publish feedback for a goal."""
        ...

    def state_changed(self) -> None:
        """Publish the states of the server's goals soon."""
        ...

    def require_result(self, result: Any) -> int:
        """Return the encoded size of a result; raise TypeError or InvalidMessageError if it is not valid."""
        ...

    def finish(self, goal: GoalProgress, result: Any, size: int) -> None:
        """Keep the result, and answer those who wait for it. None is an empty result."""
        ...


class GoalProgress:
    """The runtime's side of a goal that was accepted.

    Attributes:
        key: The goal's id as bytes.
        info: Its id, and when it was accepted.
        state: Its state.
        handle: The object that callbacks get.
        task: The running execute callback.
        started: Whether the execute callback has been started.
        finished: Whether its result is known, kept and sent.
        waiters: Futures of the requests that wait for the result.
    """

    __slots__ = ("finished", "handle", "info", "key", "server", "started", "state", "task", "waiters")

    def __init__(self, server: GoalOwner, key: bytes, info: GoalInfo, request: Any) -> None:
        self.server = server
        self.key = key
        self.info = info
        self.state = GoalState.ACCEPTED
        self.started = self.finished = False
        self.task: CallbackTask | None = None
        # Several, since any client may ask for a result, and may ask again after its link broke.
        self.waiters: dict[asyncio.Future[Any], None] = {}
        self.handle: ServerGoalHandle[Any, Any, Any] = ServerGoalHandle(self, request)

    @property
    def canceling(self) -> bool:
        """Whether its cancellation has been accepted, and it has not ended."""
        return self.state is GoalState.CANCELING

    def apply(self, event: GoalEvent) -> None:
        """Change the state.

        Raises:
            InvalidGoalTransitionError: The event cannot happen in this state.
        """
        self.state = next_state(self.state, event)
        self.server.state_changed()

    def end(self, event: GoalEvent, result: Any) -> None:
        """Enter a terminal state; finish the goal if it has a result, or no execute callback returns one.

        Raises:
            InvalidGoalTransitionError: The event cannot happen in this state.
            TypeError, InvalidMessageError: The result is not valid.
        """
        # Before the state changes: a goal with an invalid result stays as it was, and the callback sees the
        # error.
        size = 0 if result is None else self.server.require_result(result)
        self.apply(event)
        # Otherwise the execute callback will return the result, as rclpy's do.
        if result is not None or not self.started:
            self.server.finish(self, result, size)

    def wait(self) -> asyncio.Future[Any]:
        """Return a future of the response with the result."""
        waiter: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self.waiters[waiter] = None
        waiter.add_done_callback(lambda done: self.waiters.pop(done, None))
        return waiter


class ServerGoalHandle(Generic[GoalT, ResultT, FeedbackT]):
    """A goal that a client has sent. The callbacks of an action server get it.

    Args:
        goal: The runtime's side of it.
        request: The goal message.

    Attributes:
        request: The goal message.
    """

    __slots__ = ("_goal", "request")

    def __init__(self, goal: GoalProgress, request: GoalT) -> None:
        self._goal = goal
        self.request = request

    @property
    def goal_id(self) -> UUID:
        """The goal's id."""
        return self._goal.info.goal_id

    @property
    def status(self) -> GoalState:
        """The goal's state now."""
        return self._goal.state

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return not self._goal.state.is_terminal

    @property
    def is_cancel_requested(self) -> bool:
        """Whether the cancellation of the goal has been accepted."""
        return self._goal.canceling

    def publish_feedback(self, feedback: FeedbackT) -> None:
        """Send feedback to the goal's client. Never blocks; it leaves at the end of this loop turn.

        Args:
            feedback: The action's feedback message.

        Raises:
            TypeError: Not a feedback message of this action.
            InvalidMessageError: A field has a wrong type or is out of range.
            NodeDestroyed: The server has been destroyed.
        """
        self._goal.server.publish_feedback(self._goal, feedback)

    def execute(self, execute_callback: Callable[..., Any] | None = None) -> None:
        """Start the execution of a goal that was accepted; `handle_accepted_callback` or later code calls it.

        Args:
            execute_callback: Called instead of the server's.

        Raises:
            RuntimeError: The goal has been executed already, or the callback does not take one argument.
        """
        self._goal.server.execute(self._goal, execute_callback)

    def succeed(self, result: ResultT | None = None) -> None:
        """End the goal as SUCCEEDED.

        Args:
            result: The result. None: what the execute callback returns.

        Raises:
            InvalidGoalTransitionError: The goal is not being executed, or has ended.
            TypeError: Not a result of this action.
            InvalidMessageError: A field of the result has a wrong type or is out of range.
        """
        self._goal.end(GoalEvent.SUCCEED, result)

    def abort(self, result: ResultT | None = None) -> None:
        """End the goal as ABORTED.

        Args:
            result: The result. None: what the execute callback returns.

        Raises:
            InvalidGoalTransitionError: The goal has ended.
            TypeError: Not a result of this action.
            InvalidMessageError: A field of the result has a wrong type or is out of range.
        """
        self._goal.end(GoalEvent.ABORT, result)

    def canceled(self, result: ResultT | None = None) -> None:
        """End the goal as CANCELED, after a client has requested it.

        Args:
            result: The result. None: what the execute callback returns.

        Raises:
            InvalidGoalTransitionError: No cancellation has been accepted, or the goal has ended.
            TypeError: Not a result of this action.
            InvalidMessageError: A field of the result has a wrong type or is out of range.
        """
        self._goal.end(GoalEvent.CANCELED, result)
