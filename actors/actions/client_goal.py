"""A goal as its client holds it: its state, its feedback and its result."""

from __future__ import annotations

import asyncio
import copy
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, Protocol, TypeVar

from actors.actions.states import TERMINAL_STATES, GoalState
from actors.callbacks.must_await import must_await
from actors.endpoints.context import in_flight, time_limit
from actors.endpoints.iteration import Iteration
from actors.errors import GoalRejected, GoalUnknown, NodeDestroyed, WaitTimeout
from actors.interfaces.message import Message
from actors.time.timeout import DEFAULT_TIMEOUT

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.action_msgs.srv import CancelGoal
    from actors.interfaces.builtin_interfaces.msg import Time
    from actors.interfaces.unique_identifier_msgs.msg import UUID
    from actors.time.timeout import Timeout

ResultT = TypeVar("ResultT", bound=Message)
FeedbackT = TypeVar("FeedbackT", bound=Message)

FEEDBACK_DEPTH: Final = 100
"""Feedback messages of one goal that wait for `async for`; beyond that the oldest are dropped."""


class GoalResult(NamedTuple, Generic[ResultT]):
    """The terminal state of a goal, and its result."""

    status: GoalState
    """SUCCEEDED, CANCELED or ABORTED."""
    result: ResultT
    """The result message; empty if the server set none."""


class GoalSender(Protocol):
    """The part of an action client that its goals use."""

    def limit_sec(self, timeout_sec: Timeout) -> float:
        """Return a time limit in seconds."""
        ...

    async def cancel(self, goal_id: UUID, timeout_sec: Timeout) -> CancelGoal.Response:
        """Request to cancel a goal."""
        ...


class GoalReceiver:
    """The runtime's side of a goal that was sent.

    Attributes:
        goal_id: The goal's id.
        name: The action's full name, for messages.
        state: The goal's state as far as it is known.
        accepted: Whether the server has accepted it; None before its answer.
        stamp: When the server accepted or rejected it, by the server's clock; None before its answer.
        outcome: The result.
        error: Why there will be no result.
        feedback: Feedback that waits for `async for`.
        dropped: Feedback dropped because more than `FEEDBACK_DEPTH` waited.
        iterating: Whether a task waits for feedback.
        callback: Gets the feedback instead of `async for`.
        ended: Set when there is a result or an error.
        news: Set when there is feedback or the end.
    """

    def __init__(self, goal_id: UUID, name: str, callback: Callable[[Any], Any] | None) -> None:
        self.goal_id = goal_id
        self.name = name
        self.state = GoalState.UNKNOWN
        self.accepted: bool | None = None
        self.stamp: Time | None = None
        self.outcome: GoalResult[Any] | None = None
        self.error: Exception | None = None
        self.feedback: deque[Any] = deque()
        self.dropped = 0
        self.callback = callback
        self.iterating = False
        self.ended = asyncio.Event()
        self.news = asyncio.Event()

    @property
    def what(self) -> str:
        """The goal's name in messages."""
        return f"Action '{self.name}': goal {bytes(self.goal_id.uuid).hex()}"

    def decided(self, *, accepted: bool, stamp: Time) -> None:
        """Note the server's answer."""
        self.accepted, self.stamp = accepted, stamp
        if accepted:
            self.state_received(GoalState.ACCEPTED)
        else:
            self._end(GoalRejected(f"{self.what} was rejected"))

    def state_received(self, state: GoalState) -> None:
        """Note a state that the server has reported; the state never goes back."""
        # Status messages and replies travel separately, so that an older state may arrive last. The numbers
        # of the states grow with the goal's progress.
        self.state = max(self.state, state)

    def feedback_received(self, message: Any) -> Any:
        """Hand over feedback; return what the callback returns."""
        if self.callback is not None:
            return self.callback(message)
        self.feedback.append(message.feedback)
        if len(self.feedback) > FEEDBACK_DEPTH:
            self.feedback.popleft()
            self.dropped += 1
        self.news.set()
        return None

    def result_received(self, reply: asyncio.Future[Any]) -> None:
        """End the goal with the reply to the request for the result."""
        error = reply.exception()
        if isinstance(error, NodeDestroyed):  # it names a part of the client, which users do not know
            self._end(NodeDestroyed(f"{self.what}: the client has been destroyed"))
        elif isinstance(error, Exception):
            self._end(error)
        else:
            response = reply.result()
            try:
                self.outcome = goal_result(response)
            except GoalUnknown:
                self._end(GoalUnknown(f"{self.what} is not known to the server, or no longer"))
                return
            self.state = self.outcome.status
            self._end(None)

    def raise_error(self) -> None:
        """Raise why there will be no result, if so: a copy, because each raise changes the traceback."""
        if self.error is not None:
            raise copy.copy(self.error)

    def _end(self, error: Exception | None) -> None:
        self.error = error
        self.ended.set()
        self.news.set()


class ClientGoalHandle(Generic[ResultT, FeedbackT]):
    """A goal that was sent. Made by `ActionClient.send_goal`.

    `async for feedback in handle` gives the feedback that has not been read yet, and ends with the goal. It
    raises what `result` raises if the goal ends without a result.

    Args:
        receiver: The runtime's side of the goal.
        client: The client that has sent it.
    """

    def __init__(self, receiver: GoalReceiver, client: GoalSender) -> None:
        self._receiver = receiver
        self._client = client

    @property
    def goal_id(self) -> UUID:
        """The goal's id."""
        return self._receiver.goal_id

    @property
    def accepted(self) -> bool:
        """Whether the server has accepted the goal."""
        return bool(self._receiver.accepted)

    @property
    def stamp(self) -> Time | None:
        """The time at which the server accepted the goal, by its clock."""
        return self._receiver.stamp

    @property
    def status(self) -> GoalState:
        """The goal's state, as far as this client knows."""
        return self._receiver.state

    @property
    def dropped(self) -> int:
        """Feedback messages dropped here because 100 of them waited for `async for`."""
        return self._receiver.dropped

    @must_await
    async def result(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> GoalResult[ResultT]:
        """Wait until the goal has ended. It can be awaited several times.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit, as for goals that take long.

        Returns:
            The terminal state and the result message.

        Raises:
            WaitTimeout: The goal has not ended within `timeout_sec`; it goes on.
            GoalRejected: The server has rejected the goal.
            GoalUnknown: The server does not know the goal, because it has been restarted.
            ServiceUnavailable: The server or a link to the broker has died. What became of the goal is not
                known.
            RemoteError: The server's answer is not valid.
            NodeDestroyed: The client has been destroyed.
        """
        receiver = self._receiver
        if not receiver.ended.is_set():
            limit = self._client.limit_sec(timeout_sec)
            with in_flight():
                try:
                    async with time_limit(limit):
                        await receiver.ended.wait()
                except TimeoutError as error:
                    raise WaitTimeout(f"{receiver.what} has not ended within {limit:g} s") from error
        receiver.raise_error()
        assert receiver.outcome is not None
        return receiver.outcome

    @must_await
    async def cancel(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> CancelGoal.Response:
        """Request to cancel the goal. The server decides whether and when it ends: `result` waits for that.

        Args:
            timeout_sec: Seconds to wait for the answer at most; None for no limit.

        Returns:
            The answer: if the server accepts, `goals_canceling` has this goal, and `return_code` is 0.

        Raises:
            GoalRejected: The server has rejected the goal.
            CallFailed: As for `Client.call`.
        """
        if self._receiver.accepted is False:
            raise GoalRejected(f"{self._receiver.what} was rejected")
        return await self._client.cancel(self.goal_id, timeout_sec)

    def __aiter__(self) -> Iteration[FeedbackT]:
        """Iterate over the feedback, until the goal has ended.

        At most 100 messages wait; then the oldest are dropped, and counted in `dropped`.

        Returns:
            An iterator of the action's feedback messages, with `aclose`. One task at a time may use it. A
            step that is cancelled takes no message, and the next step goes on.

        Raises:
            TypeError: The goal was sent with a feedback callback.
            RuntimeError: Another task is iterating (at a step that waits).
            CallFailed, GoalRejected, NodeDestroyed: As for `result` (at the last step).
        """
        if self._receiver.callback is not None:
            raise TypeError("This goal has a feedback callback; send it without one to iterate")
        return _Feedback(self._receiver)


class _Feedback(Iteration[FeedbackT], Generic[FeedbackT]):
    """The feedback of a goal that has not been read yet."""

    def __init__(self, receiver: GoalReceiver) -> None:
        super().__init__()
        self._receiver = receiver

    async def __anext__(self) -> FeedbackT:
        receiver = self._receiver
        while not (self.closed or receiver.feedback or receiver.ended.is_set()):
            if receiver.iterating:
                raise RuntimeError("Another task is iterating over the feedback of this goal")
            # Only while it waits: a task may leave the loop and another may go on from there.
            receiver.iterating = True
            try:
                # Before the wait, in the same step as the checks above: news that arrives in between is not
                # missed.
                receiver.news.clear()
                with in_flight():
                    await receiver.news.wait()
            finally:
                receiver.iterating = False
        if not self.closed:
            if receiver.feedback:
                message: FeedbackT = receiver.feedback.popleft()
                return message
            receiver.raise_error()
        raise StopAsyncIteration

    def _wake(self) -> None:
        self._receiver.news.set()


def goal_result(response: Any) -> GoalResult[Any]:
    """Return a response with a result as users get it.

    Raises:
        GoalUnknown: The server does not know the goal.
    """
    if response.status not in TERMINAL_STATES:
        raise GoalUnknown("The server does not know the goal, or no longer")
    return GoalResult(GoalState(response.status), response.result)
