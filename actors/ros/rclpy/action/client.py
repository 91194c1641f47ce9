"""Action clients."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.ros.rclpy.action.goal_handle import GoalHandle
from actors.ros.rclpy.call_endpoint import CallEndpoint
from actors.ros.rclpy.exceptions import NotInitializedException
from actors.ros.rclpy.executor_errors import ExternalShutdownException
from actors.ros.rclpy.imported_names import imported_names
from actors.ros.rclpy.node_parts import parts_of
from actors.ros.rclpy.queued_calls import RecentCalls
from actors.ros.rclpy.thread_node import settle
from actors.threads.errors import ThreadStopped
from actors.ros.values import convert_assignments, copied, prepare, rosidl_values

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.actions.client import ActionClient as NativeClient
    from actors.actions.client_goal import ClientGoalHandle as NativeHandle
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.node import Node
    from actors.ros.rclpy.task import Future

FEEDBACK_DEPTH: Final = 10
"""Feedback messages that wait for the executor, as in rclpy; then the oldest are dropped."""


T = TypeVar("T")

__getattr__ = imported_names(
    __name__,
    "CancelGoal Future GoalStatus NumberOfEntities QoSProfile UUID Waitable await_or_execute "
    "qos_profile_action_status_default qos_profile_services_default",
)


class GoalFeedback:
    """The feedback of one goal, in the loop.

    Some may arrive before the program knows that the goal is accepted. It waits here until then.

    Args:
        calls: Makes the calls of the callback.
        callback: The program's.
    """

    def __init__(self, calls: RecentCalls, callback: Callable[[Any], Any]) -> None:
        self._calls = calls
        self._callback = callback
        self._early: deque[Callable[[], Any]] | None = deque()

    def receive(self, message: Any) -> None:
        """Call the callback with a message."""

        def call() -> Any:
            return self._callback(rosidl_values(message))

        if self._early is None:
            self._calls.add(call)
            return
        self._early.append(call)
        if len(self._early) > FEEDBACK_DEPTH:
            self._early.popleft()
            self._calls.dropped += 1

    def release(self) -> None:
        """Let the early feedback, and all that follows, wait no longer."""
        early, self._early = self._early or (), None
        for call in early:
            self._calls.add(call)


class ClientGoalHandle(GoalHandle["NativeHandle[Any, Any]"]):
    """A goal that was sent. Made by `ActionClient.send_goal_async`."""

    def __init__(
        self, client: ActionClient, native: NativeHandle[Any, Any], feedback: GoalFeedback | None
    ) -> None:
        super().__init__(native)
        self._client = client
        self._feedback = feedback

    def __repr__(self) -> str:
        goal_id = list(self.goal_id.uuid)
        return f"ClientGoalHandle <id={goal_id}, accepted={self.accepted}, status={self.status}>"

    @property
    def stamp(self) -> Any:
        """The time at which the server accepted the goal, by its clock."""
        return self._native.stamp

    @property
    def accepted(self) -> bool:
        """Whether the server has accepted the goal."""
        return self._native.accepted

    def cancel_goal_async(self) -> Future[Any]:
        """Ask the server to cancel the goal; return a future of its response."""
        return self._client.start(lambda: self._native.cancel(None))

    def cancel_goal(self) -> Any:
        """Ask the server to cancel the goal; wait for its response and return it."""
        return self._client.wait_for(lambda: self._native.cancel(None))

    def get_result_async(self) -> Future[Any]:
        """Return a future of the GetResult response, with `status` and `result`."""
        return self._client._get_result_async(self)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]

    def get_result(self) -> Any:
        """Wait for the GetResult response, and return it."""
        return self._client._get_result(self)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]

    async def result(self) -> Any:
        """Return the GetResult response; in the loop."""
        response = self._client.action_type.Impl.GetResultService.Response()
        # rclpy asks the server, which answers with the defaults for a goal that it does not know.
        if self.accepted:
            if self._feedback is not None:
                self._feedback.release()  # before the result
            outcome = await self._native.result(None)
            response.status, response.result = int(outcome.status), rosidl_values(outcome.result)
        return response


class ActionClient(CallEndpoint):
    """Sends goals to an action server.

    Args:
        node: The node.
        action_type: The action class.
        action_name: The name of the action.
        callback_group: When callbacks may run; None for the node's default group.
        qos: Profiles of its services and topics: not used.

    Attributes:
        action_type: The action class.
    """

    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        **qos: Any,
    ) -> None:
        # callboard's actions always have ROS 2's default profiles, so that both sides agree.
        del qos
        self._context = node.context
        super().__init__(self._context.thread, callback_group or node.default_callback_group)
        self.action_type = action_type
        self._feedback = RecentCalls(self, FEEDBACK_DEPTH)
        self._native: NativeClient[Any, Any, Any] = self._thread.call(
            lambda: parts_of(node).native.create_action_client(action_type, action_name)
        )
        convert_assignments(action_type.Goal)
        prepare(action_type.Feedback, action_type.Result)
        self.lifeline = parts_of(node).lifeline
        node.add_waitable(self)

    def wait_for(self, work: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Wait for a coroutine of the loop; no thread needs to spin. Raise as `Context.wait` does."""
        return self._context.wait(work)

    def send_goal_async(
        self, goal: Any, feedback_callback: Callable[[Any], Any] | None = None, goal_uuid: Any = None
    ) -> Future[ClientGoalHandle]:
        """Send a goal; without a server it waits for one.

        Args:
            goal: The goal message.
            feedback_callback: Gets each feedback message (`message.feedback`), where the executor spins.
            goal_uuid: The goal's id; None for a random one.

        Returns:
            A future of the goal, once the server has accepted or rejected it.

        Raises:
            TypeError: Not a goal message of this action.
            InvalidMessageError: A field has a wrong type or is out of range.
        """
        self._check(goal)
        # The loop encodes it later, and the program may change it in the meantime.
        goal = copied(goal)
        if feedback_callback is None:
            return self.start(lambda: self._send(goal, None, goal_uuid))
        feedback = GoalFeedback(self._feedback, feedback_callback)
        future = self.start(lambda: self._send(goal, feedback, goal_uuid))
        future.add_done_callback(lambda _: self._release(feedback))
        return future

    def send_goal(self, goal: Any, **kwargs: Any) -> Any:
        """Send a goal and wait for its result.

        Args:
            goal: The goal message.
            kwargs: As for `send_goal_async`.

        Returns:
            The GetResult response; None if the server has rejected the goal.

        Raises:
            TypeError: Not a goal message of this action.
        """
        self._check(goal)
        callback, goal_uuid = kwargs.get("feedback_callback"), kwargs.get("goal_uuid")
        feedback = None if callback is None else GoalFeedback(self._feedback, callback)
        if feedback is not None:
            feedback.release()  # the program learns of the goal by its feedback
        handle = self.wait_for(lambda: self._send(goal, feedback, goal_uuid))
        return handle.get_result() if handle.accepted else None

    # Private, and rclpy's: there are programs that call these.

    def _get_result_async(self, goal_handle: ClientGoalHandle) -> Future[Any]:
        return self.start(goal_handle.result)

    def _get_result(self, goal_handle: ClientGoalHandle) -> Any:
        return self.wait_for(goal_handle.result)

    def _check(self, goal: Any) -> None:
        if not isinstance(goal, self.action_type.Goal):
            raise TypeError(f"Expected a {self.action_type.Goal.__qualname__}, got {goal!r}")

    def _release(self, feedback: GoalFeedback) -> None:
        with suppress(ThreadStopped):  # the program ends
            self._thread.post(feedback.release)

    async def _send(self, goal: Any, feedback: GoalFeedback | None, goal_uuid: Any) -> ClientGoalHandle:
        # A goal that is sent early waits for a server; callboard's own client would fail at once, which
        # programs written for ROS 2 do not expect.
        await self._native.wait_for_server(None)
        # Bounded: a program that does not spin must not collect feedback without end.
        receive = None if feedback is None else feedback.receive
        native = await self._native.send_goal(goal, receive, goal_uuid, timeout_sec=None)
        return ClientGoalHandle(self, native, feedback)

    def server_is_ready(self) -> bool:
        """Return whether there is a server."""
        settle(self._thread)
        return self._native.server_is_ready()

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server.

        Args:
            timeout_sec: Seconds to wait; None for no limit.

        Returns:
            Whether there is one; False as well if the context is shut down meanwhile.
        """
        try:
            settle(self._thread)
            return self._context.wait(lambda: self._native.wait_for_server(timeout_sec))
        except (ExternalShutdownException, NotInitializedException):
            return False

    def destroy(self) -> None:
        """Take the client out of service; its futures end with an exception."""
        node = self.node
        if node is not None:
            node.remove_waitable(self)
        super().destroy()
