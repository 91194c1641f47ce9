"""Action servers. Callbacks run where the executor spins; goals are executed as its tasks."""

from __future__ import annotations

from asyncio import CancelledError
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.actions.server_callbacks import CancelResponse as CancelResponse
from actors.actions.server_callbacks import GoalResponse as GoalResponse
from actors.errors import InvalidGoalTransitionError
from actors.ros.rclpy._rclpy_pybind11 import RCLError as RCLError
from actors.ros.rclpy.action.goal_handle import GoalHandle
from actors.ros.rclpy.entity import destroy_with, weakly
from actors.ros.rclpy.call_endpoint import CallEndpoint
from actors.ros.values import convert_assignments, prepare, rosidl_values
from actors.ros.rclpy.node_parts import parts_of
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.actions.server_goal import ServerGoalHandle as NativeHandle
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.node import Node

__getattr__ = imported_names(
    __name__,
    "Future GoalInfo GoalStatus NumberOfEntities QoSProfile Waitable await_or_execute "
    "qos_profile_action_status_default qos_profile_services_default",
)

AnswerT = TypeVar("AnswerT", GoalResponse, CancelResponse)
WARNING_PERIOD_SEC: Final = 1.0
"""Time between two warnings about wrong answers of a callback."""


def default_goal_callback(goal_request: object) -> GoalResponse:
    """Accept every goal."""
    del goal_request
    return GoalResponse.ACCEPT


def default_cancel_callback(cancel_request: object) -> CancelResponse:
    """Reject every cancellation."""
    del cancel_request
    return CancelResponse.REJECT


def default_handle_accepted_callback(goal_handle: ServerGoalHandle) -> None:
    """Execute the goal."""
    goal_handle.execute()


class ServerGoalHandle(GoalHandle["NativeHandle[Any, Any, Any]"]):
    """A goal that a client has sent."""

    def __init__(self, server: ActionServer, native: NativeHandle[Any, Any, Any]) -> None:
        super().__init__(native)
        self._server = server

    @property
    def request(self) -> Any:
        """The goal message."""
        return self._native.request

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self._native.is_active

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a cancellation has been accepted."""
        return self._native.is_cancel_requested

    def execute(self, execute_callback: Callable[[Any], Any] | None = None) -> None:
        """Start the execution of an accepted goal, by the server's callback or by another one."""
        if not self.is_active:
            raise RCLError("The goal has ended")
        self._server.call(lambda: self._native.execute(self._server.executing(execute_callback)))

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the goal's client."""
        self._server.call(lambda: self._native.publish_feedback(feedback))

    def succeed(self) -> None:
        """End the goal as succeeded, with the result that the callback returns."""
        self._server.call(self._native.succeed)

    def abort(self) -> None:
        """End the goal as aborted, with the result that the callback returns."""
        self._server.call(self._native.abort)

    def canceled(self) -> None:
        """End the goal as canceled, with the result that the callback returns."""
        self._server.call(self._native.canceled)


class ActionServer(CallEndpoint):
    """Executes goals.

    Args:
        node: The node.
        action_type: The action class.
        action_name: The name of the action.
        execute_callback: Gets a ServerGoalHandle, ends the goal, and returns the result.
        callback_group: When the other callbacks may run; None for the node's default group.
        goal_callback: Gets the goal message, returns a GoalResponse. Default: accept.
        handle_accepted_callback: Gets each accepted goal, and executes it now or later. Default: now.
        cancel_callback: Gets the ServerGoalHandle, returns a CancelResponse. Default: reject.
        result_timeout: Seconds to keep results for clients that ask late.
        qos: Profiles of its services and topics: not used.
    """

    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[Any], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], Any] | None = default_goal_callback,
        handle_accepted_callback: Callable[[Any], Any] | None = default_handle_accepted_callback,
        cancel_callback: Callable[[Any], Any] | None = default_cancel_callback,
        result_timeout: float = 10,
        **qos: Any,
    ) -> None:
        del qos
        super().__init__(node.context.thread, callback_group or node.default_callback_group)
        # Before the server is declared: the first goal may arrive at once.
        self.register_goal_callback(goal_callback)
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_cancel_callback(cancel_callback)
        self.register_execute_callback(execute_callback)
        self.action_type = action_type
        self._logger = node.get_logger().get_child("action_server")
        self._handles: dict[bytes, ServerGoalHandle] = {}
        """Handles of the goals that have not ended. Only the loop changes it."""
        prepare(action_type.Goal)
        self._native = self._thread.call(
            lambda: parts_of(node).native.create_action_server(
                action_type,
                action_name,
                weakly(self._execute),
                goal_callback=weakly(self._decide),
                cancel_callback=weakly(self._cancel),
                handle_accepted_callback=weakly(self._accepted),
                result_timeout_sec=result_timeout,
            )
        )
        destroy_with(self, self._thread, self._native.destroy)
        convert_assignments(action_type.Result)
        convert_assignments(action_type.Feedback)
        node.add_waitable(self)

    def call(self, work: Callable[[], Any]) -> Any:
        """Change a goal in the loop.

        Raises:
            RCLError: The goal's state does not allow the change.
        """
        try:
            return self._thread.call(work)
        except InvalidGoalTransitionError as error:
            raise RCLError(str(error)) from error

    def _handle_of(self, native: NativeHandle[Any, Any, Any]) -> ServerGoalHandle:
        """Return the handle of a goal, the same for all callbacks: programs set attributes on it."""
        key = bytes(native.goal_id.uuid)
        handle = self._handles.get(key)
        if handle is None:
            # Ended ones are removed here, when another goal begins, and not when they end: a program may
            # still hold and use them in the callback that ends them.
            active = {key: each for key, each in self._handles.items() if each.is_active}
            handle = ServerGoalHandle(self, native)
            self._handles = {**active, key: handle}
        return handle

    async def _decide(self, request: Any) -> GoalResponse:
        answer = await self.run(lambda: self._goal_callback(rosidl_values(request)))
        # As in rclpy: a callback that forgets to return rejects.
        return self._checked(answer, GoalResponse.REJECT, "goal")

    async def _cancel(self, native: NativeHandle[Any, Any, Any]) -> CancelResponse:
        answer = await self.run(self._cancel_callback, self._handle_of(native))
        return self._checked(answer, CancelResponse.REJECT, "cancel")

    def _checked(self, answer: object, default: AnswerT, kind: str) -> AnswerT:
        if isinstance(answer, type(default)):
            return answer
        # Clients cause as many of these as they like.
        self._logger.warning(
            f"The {kind} callback of {self._native.action_name} returned {answer!r}, not a"
            f" {type(default).__name__}: rejected",
            throttle_duration_sec=WARNING_PERIOD_SEC,
        )
        return default

    async def _accepted(self, native: NativeHandle[Any, Any, Any]) -> None:
        with suppress(CancelledError):  # the node is being left, which aborts the goal
            await self.run(self._handle_accepted_callback, self._handle_of(native))

    def executing(self, callback: Callable[[Any], Any] | None) -> Callable[[Any], Any]:
        """Return the execute callback for callboard; None: call the one that is registered then."""
        return partial(self._execute, callback=callback)

    async def _execute(
        self, native: NativeHandle[Any, Any, Any], callback: Callable[[Any], Any] | None = None
    ) -> Any:
        try:
            # As a task of the executor, outside the callback group: an execution takes long, and would
            # otherwise keep out the cancel callback, which is in the group.
            return await self.run_task(callback or self._execute_callback, self._handle_of(native))
        except CancelledError:  # the node is being left
            if native.is_active:
                native.abort()
            return None

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Set the function that accepts goals; None accepts all."""
        self._goal_callback = goal_callback or default_goal_callback

    def register_cancel_callback(self, cancel_callback: Callable[[Any], Any] | None) -> None:
        """Set the function that accepts cancellations; None rejects all."""
        self._cancel_callback = cancel_callback or default_cancel_callback

    def register_handle_accepted_callback(self, callback: Callable[[Any], Any] | None) -> None:
        """Set the function that gets accepted goals; None executes them at once."""
        self._handle_accepted_callback = callback or default_handle_accepted_callback

    def register_execute_callback(self, execute_callback: Callable[[Any], Any]) -> None:
        """Set the function that executes goals."""
        if not callable(execute_callback):
            raise TypeError("Failed to register goal execution callback: not callable")
        self._execute_callback = execute_callback

    def destroy(self) -> None:
        """Take the server out of service."""
        node = self.node
        if node is not None:
            node.remove_waitable(self)
        super().destroy()
