"""The runtime's side of an action server: three services, two topics, and the goals."""

from __future__ import annotations

import asyncio
import inspect
import math
from dataclasses import fields
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actors.actions.names import ActionNames
from actors.actions.results import KeptResults
from actors.actions.server_callbacks import CancelResponse, GoalResponse, ServerCallbacks, awaited
from actors.actions.server_goal import GoalProgress
from actors.actions.states import GoalEvent, GoalState
from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import takes
from actors.endpoints.endpoint import Endpoint, Handle
from actors.endpoints.publisher.publisher import Publisher
from actors.endpoints.service.service import ServiceServer
from actors.interfaces.action import action_types
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.qos.profile import qos_profile_action_status_default, qos_profile_default

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.context import NodeContext
    from actors.interfaces.builtin_interfaces.msg import Time

MAX_GOALS: Final = 1000
"""Goals of one server that have not ended; further ones are rejected."""

STATUS_PERIOD_SEC: Final = 0.01
"""The least time between two status messages."""

STATUS_GOAL_SEC: Final = 0.0001
"""The least time for each goal that they list: long lists must not occupy the loops of server and clients."""

NO_ID: Final = bytes(16)
"""In a request to cancel, it stands for all goals."""


class ActionServerEndpoint(Endpoint):
    """The runtime's side of an action server.

    The broker does not know it: its parts, two publishers and three services, are declared.

    Attributes:
        goals: Goals that have not finished, by id.
        results: Results of finished goals.
        refused_goals: Goals rejected because of `MAX_GOALS`.
    """

    kind: ClassVar = "action server"

    def __init__(
        self,
        context: NodeContext,
        action_type: Any,
        name: str,
        callbacks: ServerCallbacks,
        *,
        result_timeout_sec: float,
        cancel_execution: bool,
    ) -> None:
        if math.isnan(result_timeout_sec):
            raise ValueError("result_timeout_sec must be a number of seconds, negative for no limit")
        types: Any = action_types(action_type)
        names = ActionNames.of(name)
        # Before anything is declared: a callback with a wrong signature must not leave half a server
        # behind.
        for field in fields(callbacks):
            takes(getattr(callbacks, field.name), (1,), field.name)
        super().__init__(context)
        # By id as bytes, because messages (UUID) are mutable and so have no hash.
        self.goals: dict[bytes, GoalProgress] = {}
        self.results = KeptResults(result_timeout_sec)
        self.refused_goals = 0
        self._action = action_type
        self._types = types
        self._name = name
        self._callbacks = callbacks
        self._cancel_execution = cancel_execution
        self._timing = context.watch.of(callbacks.execute, f"the action '{name}'")
        self._accept_timing = context.watch.of(callbacks.handle_accepted, f"the action '{name}'")
        self._accepting: dict[GoalProgress, CallbackTask] = {}  # handle-accepted callbacks that run
        # Kept apart from `goals`: a goal without a decision has no state yet, and must not show up in the
        # status.
        self._deciding: set[bytes] = set()
        """Goals whose goal callback is running."""
        self._status_due: asyncio.TimerHandle | None = None
        self._status_at = -math.inf
        """Loop time of the last status message."""
        self._expiry: asyncio.TimerHandle | None = None
        self._result_codec: Any = codec_for(self._action.Result)
        self._feedback: Publisher[Any]
        self._feedback = Publisher(context, types.feedback_message, names.feedback, qos_profile_default)
        self._status = Publisher(context, GoalStatusArray, names.status, qos_profile_action_status_default)
        # The publishers come first, so that they are matched when the first goal arrives.
        self.services = self._serve(names)
        self._parts: list[Handle[Any]] = [self._feedback, self._status, *self.services]

    def _serve(self, names: ActionNames) -> list[ServiceServer[Any, Any]]:
        services = [
            ServiceServer[Any, Any](
                self.context,
                srv_type,
                srv_type.Request,
                srv_type.Response,
                name,
                callback=callback,
                # Concurrent, so that a cancel request gets through while the goal callback of another goal,
                # or the node's mailbox, waits.
                concurrent=True,
            )
            for srv_type, name, callback in (
                (self._types.send_goal, names.send_goal, self._goal_requested),
                (CancelGoal, names.cancel_goal, self._cancel_requested),
                (self._types.get_result, names.get_result, self._result_requested),
            )
        ]
        services[-1].reply_after(self._feedback)  # the results, and only these
        return services

    @property
    def part_refusal(self) -> str:
        """Why the broker has refused one of the declared parts; "" if it has refused none."""
        return next(filter(None, (part.refusal for part in self._parts)), "")

    # Requests

    async def _goal_requested(self, request: Any) -> Any:
        key = bytes(request.goal_id.uuid)
        response = self._types.send_goal.Response()
        # An id that is in use, or was until recently, would make two goals indistinguishable in status and
        # feedback.
        if key in self.goals or key in self._deciding or self.results.get(key) is not None:
            _warn_of_rejected(self.context, self._name, f"its id {key.hex()} exists already")
            return response
        # Those that are being decided count as well. Otherwise a slow goal callback would let in any
        # number.
        if len(self.goals) + len(self._deciding) >= MAX_GOALS:
            self.refused_goals += 1
            _warn_of_rejected(self.context, self._name, f"{MAX_GOALS} goals have not ended")
            return response
        self._deciding.add(key)
        try:
            decision = await self._decide(request.goal)
        finally:
            self._deciding.discard(key)
        # The server may have been destroyed while the goal callback waited.
        if decision is not GoalResponse.ACCEPT or self.destroyed:
            return response
        response.accepted, response.stamp = True, self.context.clock.now().to_msg()
        goal = GoalProgress(self, key, GoalInfo(goal_id=request.goal_id, stamp=response.stamp), request.goal)
        self.goals[key] = goal
        self.state_changed()
        self._handle_accepted(goal)
        return response

    def _handle_accepted(self, goal: GoalProgress) -> None:
        """Call the handle-accepted callback; the answer to the client does not wait for its end."""

        def ended(result: object, error: BaseException | None) -> None:
            del result
            self._accepting.pop(goal, None)
            if error is None or (self.destroyed and isinstance(error, asyncio.CancelledError)):
                return
            if not (goal.started or goal.state.is_terminal or self.destroyed):
                goal.end(GoalEvent.ABORT, None)  # nothing else would end it
            self.context.callback_failed(self._accept_timing.what, error)

        try:
            outcome = self._callbacks.handle_accepted(goal.handle)
        except Exception as error:  # noqa: BLE001 - the user's: logged, counted, the goal is aborted
            ended(None, error)
            return
        if inspect.isawaitable(outcome):
            coroutine = outcome if inspect.iscoroutine(outcome) else awaited(outcome)
            task = CallbackTask(self.context.mailbox, coroutine, ended, self._accept_timing)
            self._accepting[goal] = task
            # As a callback task, so that its steps count for the callback budget, and the node waits for it
            # when it stops.
            self.context.mailbox.run_concurrently(task)

    async def _decide(self, request: Any) -> GoalResponse:
        try:
            decision = await awaited(self._callbacks.goal(request))
        except Exception as error:  # noqa: BLE001 - the user's: logged, counted, the goal is rejected
            self.context.callback_failed(f"The goal callback of the action '{self._name}'", error)
            return GoalResponse.REJECT
        if not isinstance(decision, GoalResponse):
            self.context.log.warning(
                f"The goal callback of the action '{self._name}' returned {decision!r}, no GoalResponse:"
                " the goal is rejected"
            )
            return GoalResponse.REJECT
        return decision

    async def _cancel_requested(self, request: CancelGoal.Request) -> CancelGoal.Response:
        response = CancelGoal.Response()
        key = bytes(request.goal_info.goal_id.uuid)
        goals = self._to_cancel(key, request.goal_info.stamp)
        if not goals and key != NO_ID:
            # In `goals` but not active: its terminal state is set, and the execute callback has yet to
            # return the result.
            ended = key in self.goals or self.results.get(key) is not None
            code = response.ERROR_GOAL_TERMINATED if ended else response.ERROR_UNKNOWN_GOAL_ID
            response.return_code = code
            return response
        for goal in goals:
            if await self._cancel(goal):
                response.goals_canceling.append(goal.info)
        if goals and not response.goals_canceling:
            response.return_code = response.ERROR_REJECTED
        return response

    def _to_cancel(self, key: bytes, stamp: Time) -> list[GoalProgress]:
        """Return the active goals that a request to cancel names: by id, by time, or all of them."""
        until = (stamp.sec, stamp.nanosec)
        active = [goal for goal in self.goals.values() if not goal.state.is_terminal]
        if key == NO_ID and until == (0, 0):
            return active
        return [
            goal
            for goal in active
            if goal.key == key or (goal.info.stamp.sec, goal.info.stamp.nanosec) <= until != (0, 0)
        ]

    async def _cancel(self, goal: GoalProgress) -> bool:
        """Ask the cancel callback; return whether the goal is being cancelled."""
        # Accepted already: another request gets the same answer, without asking again.
        if goal.canceling:
            return True
        try:
            decision = await awaited(self._callbacks.cancel(goal.handle))
        except Exception as error:  # noqa: BLE001 - the user's: logged, counted, the goal goes on
            self.context.callback_failed(f"The cancel callback of the action '{self._name}'", error)
            return False
        # The goal may have ended while the cancel callback waited.
        if decision != CancelResponse.ACCEPT or goal.state.is_terminal:
            return False
        # Nor has another request been accepted in the meantime: CANCELING has no transition to itself.
        if not goal.canceling:
            goal.apply(GoalEvent.CANCEL_GOAL)
        if self._cancel_execution:
            if goal.task is not None:
                goal.task.cancel()
            # Nothing runs that could notice the cancellation, so it takes effect here.
            elif not goal.started:
                goal.end(GoalEvent.CANCELED, None)
        return True

    async def _result_requested(self, request: Any) -> Any:
        key = bytes(request.goal_id.uuid)
        goal = self.goals.get(key)
        if goal is not None:
            # The reply waits as long as the goal runs; the client's request has no deadline.
            return await goal.wait()
        kept = self.results.get(key)
        # Status UNKNOWN, as in ROS 2. An error would not tell an unknown goal from a failed server.
        return self._types.get_result.Response() if kept is None else kept.response

    # What goals call

    def execute(self, goal: GoalProgress, callback: Callable[..., Any] | None) -> None:
        """Start the execute callback of a goal, unless the goal has ended."""
        if goal.started:
            raise RuntimeError("This goal has been executed already")
        if callback is not None:
            takes(callback, (1,), "execute")
        if goal.state.is_terminal or self.destroyed:
            return
        # Before the callback is called: it may call `execute` on its own handle.
        goal.started = True
        if goal.state is GoalState.ACCEPTED:
            goal.apply(GoalEvent.EXECUTE)

        def ended(result: object, error: BaseException | None) -> None:
            goal.task = None
            self._executed(goal, result, error)

        execute = callback or self._callbacks.execute
        # A coroutine function is not wrapped: the node names the callbacks that it waits for when it stops.
        direct = inspect.iscoroutinefunction(execute)
        coroutine = execute(goal.handle) if direct else _run(execute, goal)
        goal.task = CallbackTask(self.context.mailbox, coroutine, ended, self._timing)
        self.context.mailbox.run_concurrently(goal.task)

    def _executed(self, goal: GoalProgress, result: Any, error: BaseException | None) -> None:
        """Finish a goal whose execute callback has ended."""
        # Without `cancel_execution`, as in rclpy, the callback sees the request in `is_cancel_requested`
        # and decides by itself; CancelledError is then an error like others.
        asked = goal.canceling and self._cancel_execution
        if error is not None:
            result = None
            if not (isinstance(error, asyncio.CancelledError) and (asked or self.destroyed)):
                self.context.callback_failed(self._timing.what, error)
        # `succeed(result)` has finished it before the callback returned.
        if goal.finished or self.destroyed:
            return
        size = 0
        if result is not None:
            try:
                # Checked here: an invalid result would otherwise fail when the reply is encoded, where
                # nobody could answer those who wait.
                size = self.require_result(result)
            except (TypeError, InvalidMessageError) as wrong:
                self.context.callback_failed(self._timing.what, wrong)
                result, error = None, wrong
        if not goal.state.is_terminal:
            if asked and isinstance(error, asyncio.CancelledError):
                goal.apply(GoalEvent.CANCELED)
            else:
                if error is None:
                    self.context.log.warning(
                        f"{self._timing.what} set no terminal state: the goal is aborted"
                    )
                goal.apply(GoalEvent.ABORT)
        self.finish(goal, result, size)

    def publish_feedback(self, goal: GoalProgress, feedback: Any) -> None:
        """Publish feedback for a goal."""
        if not isinstance(feedback, self._action.Feedback):
            raise TypeError(f"Expected {self._action.__name__}.Feedback, got {type(feedback).__name__}")
        message = self._types.feedback_message(goal_id=goal.info.goal_id, feedback=feedback)
        self._feedback.publish(message)

    def require_result(self, result: Any) -> int:
        """Return the encoded size of a result; raise TypeError or InvalidMessageError if it is not valid."""
        if not isinstance(result, self._action.Result):
            raise TypeError(f"Expected {self._action.__name__}.Result, got {type(result).__name__}")
        return len(self._result_codec.encode(result))

    def finish(self, goal: GoalProgress, result: Any, size: int) -> None:
        """Keep the result, and answer those who wait for it. None is an empty result."""
        if goal.finished or self.destroyed:
            return
        result = self._action.Result() if result is None else result
        response = self._types.get_result.Response(status=int(goal.state), result=result)
        goal.finished = True
        del self.goals[goal.key]
        loop = self.context.require_loop()
        self.results.add(goal.key, goal.info, response, size=size, now=loop.time())
        # After the result is kept, so that there is no moment at which a new request finds it nowhere.
        for waiter in tuple(goal.waiters):
            if not waiter.done():
                waiter.set_result(response)
        self._expire_later(loop)
        self.state_changed()

    # Status

    def state_changed(self) -> None:
        """Publish the states of all goals: in the next loop turn, or when the last message is old enough."""
        if self._status_due is None and not self.destroyed:
            loop = self.context.require_loop()
            # In proportion to the list: each message names all goals, so that a thousand goals with a
            # message for each change would cost a million entries.
            period = max(STATUS_PERIOD_SEC, STATUS_GOAL_SEC * (len(self.goals) + len(self.results)))
            at = max(loop.time(), self._status_at + period)
            self._status_due = loop.call_at(at, self._publish_status)

    def _publish_status(self) -> None:
        self._status_due = None
        self._status_at = self.context.require_loop().time()
        states = [(goal.info, int(goal.state)) for goal in self.goals.values()]
        # Ended goals are part of the status for as long as their results are kept, as in ROS 2.
        states += [(kept.info, kept.response.status) for kept in self.results]
        status = [GoalStatus(goal_info=info, status=state) for info, state in states]
        self._status.publish(GoalStatusArray(status_list=status))

    def _expire_later(self, loop: asyncio.AbstractEventLoop) -> None:
        if self._expiry is None and self.results.next_expiry < math.inf:
            # One timer, set to the oldest: results expire in the order in which they were added.
            self._expiry = loop.call_at(self.results.next_expiry, self._expire)

    def _expire(self) -> None:
        self._expiry = None
        loop = self.context.require_loop()
        self.results.expire(loop.time())
        self._expire_later(loop)
        self.state_changed()

    # The end

    def retire(self) -> None:
        """Abort the goals whose execution has not begun, as the node stops: nothing else would end them."""
        for goal in tuple(self.goals.values()):
            if not goal.started and not goal.state.is_terminal:
                goal.end(GoalEvent.ABORT, None)

    def destroy(self) -> None:
        """Take the server out of service: execute callbacks are cancelled, clients get ServiceUnavailable."""
        if self.destroyed:
            return
        if self._expiry is not None:
            self._expiry.cancel()
        if self._status_due is not None:
            self._status_due.cancel()
            # The last states, which clients would otherwise never see: the timer for them has just been
            # cancelled.
            if not self._status.destroyed:
                self._publish_status()
        # First marks this as destroyed, so that what the cancelled callbacks still do changes nothing.
        super().destroy()
        for task in (*self._accepting.values(), *(goal.task for goal in self.goals.values())):
            if task is not None:
                task.cancel()
        self.goals.clear()
        for part in self._parts:
            part.destroy()


def _warn_of_rejected(context: NodeContext, action: str, reason: str) -> None:
    if context.may_log("rejected goals"):
        context.log.warning(f"Action '{action}' rejects a goal: {reason}")


async def _run(callback: Callable[..., Any], goal: GoalProgress) -> Any:
    return await awaited(callback(goal.handle))
