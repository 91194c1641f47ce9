"""The action client: three clients, two subscriptions, and the goals in flight."""

from __future__ import annotations

import uuid
from contextvars import copy_context
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic

from actors.actions.client_goal import (
    ClientGoalHandle,
    FeedbackT,
    GoalReceiver,
    GoalResult,
    ResultT,
    goal_result,
)
from actors.actions.names import ActionNames
from actors.actions.server_goal import GoalT
from actors.actions.states import STATES, GoalState
from actors.callbacks.callback_task import current_callback_task
from actors.callbacks.functions import takes
from actors.callbacks.must_await import must_await
from actors.endpoints.client.client import Client
from actors.endpoints.endpoint import Endpoint, Handle, endpoint_of
from actors.endpoints.subscription.subscription import Subscription
from actors.errors import ServiceTimeout, ServiceUnavailable, WaitTimeout
from actors.interfaces.action import action_types, require_action
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.qos.profile import qos_profile_action_status_default, qos_profile_default
from actors.time.timeout import DEFAULT_TIMEOUT

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.client.endpoint import CallFuture
    from actors.endpoints.context import NodeContext
    from actors.endpoints.service_introspection import ServiceIntrospectionState
    from actors.qos.profile import QoSProfile
    from actors.time.clock import Clock
    from actors.time.timeout import Timeout


class ActionClientEndpoint(Endpoint):
    """The runtime's side of an action client.

    The broker does not know it: its parts, two subscriptions and three clients, are declared.

    Attributes:
        name: The action's full name.
        goals: The goals in flight, by id.
        statuses: The last status message.
    """

    kind: ClassVar = "action client"

    def __init__(self, context: NodeContext, action_type: type, name: str) -> None:
        types, names = action_types(action_type), ActionNames.of(name)
        super().__init__(context)
        self.name = name
        self.goals: dict[bytes, GoalReceiver] = {}
        self.statuses: list[GoalStatus] = []
        self._types: Any = types
        # The subscriptions come first, so that they are matched when the first goal is sent.
        subscriptions = [
            self._subscribe(types.feedback_message, names.feedback, self._feedback_received),
            self._subscribe(
                GoalStatusArray, names.status, self._status_received, qos_profile_action_status_default
            ),
        ]
        self._send = self._client(types.send_goal, names.send_goal)
        self._cancel: Client[CancelGoal.Request, CancelGoal.Response]
        self._cancel = self._client(CancelGoal, names.cancel_goal)
        self._results = self._client(types.get_result, names.get_result)
        self._results.receive_after(subscriptions[0])
        self._parts: list[Handle[Any]] = [*subscriptions, self._send, self._cancel, self._results]

    def _subscribe(
        self, msg_type: Any, topic: str, callback: Callable[..., Any], qos: Any = qos_profile_default
    ) -> Subscription[Any]:
        return Subscription(self.context, msg_type, topic, callback, qos, concurrent=False, raw=False)

    def _client(self, srv_type: Any, name: str) -> Client[Any, Any]:
        return Client(self.context, srv_type, srv_type.Request, srv_type.Response, name)

    @property
    def clients(self) -> tuple[Client[Any, Any], ...]:
        """The clients of the action's services."""
        return self._send, self._cancel, self._results

    @property
    def ready(self) -> bool:
        """Whether all five parts are matched with a server's."""
        # All five: with only some of them matched, a goal could be accepted whose result or feedback is
        # then lost.
        return all(each.peers > 0 for each in self._parts)

    def require_not_refused(self) -> None:
        """Raise ServiceUnavailable if the broker of this session has refused one of the parts."""
        for refusal in filter(None, (endpoint_of(part).refusal for part in self._parts)):
            raise ServiceUnavailable(f"Action '{self.name}': {refusal}")

    async def send(self, receiver: GoalReceiver, goal: Any, timeout_sec: Timeout) -> None:
        """Send a goal, and ask for its result once it is accepted."""
        key = bytes(receiver.goal_id.uuid)
        if key in self.goals:
            raise ValueError(f"{receiver.what} is in flight already")
        self.goals[key] = receiver  # before it is sent: feedback may arrive before the answer
        try:
            request = self._types.send_goal.Request(goal_id=receiver.goal_id, goal=goal)
            response = await self._send.call(request, timeout_sec)
            if response.accepted:
                # At once, not when the user asks for it: a server keeps results for a limited time, and the
                # end of the goal is news for `async for`, too.
                reply = self._request_result(receiver.goal_id)
                reply.add_done_callback(partial(self._ended, key, receiver))
            receiver.decided(accepted=response.accepted, stamp=response.stamp)
        finally:
            # Rejected, failed or cancelled: there is nothing to receive. An accepted goal stays until its
            # result.
            if not receiver.accepted:
                del self.goals[key]

    def _ended(self, key: bytes, receiver: GoalReceiver, reply: CallFuture) -> None:
        del self.goals[key]
        receiver.result_received(reply)

    def _request_result(self, goal_id: UUID) -> Any:
        """Ask for the result, without a time limit.

        Not as a call of the current callback: that would let others run until the goal ends.
        """
        request = self._types.get_result.Request(goal_id=goal_id)
        context = copy_context()
        context.run(current_callback_task.set, None)
        return context.run(self._results.call_async, request, None)

    def limit_sec(self, timeout_sec: Timeout) -> float:
        """Return a time limit in seconds."""
        return self.context.limit_sec(timeout_sec)

    async def cancel(self, goal_id: UUID, timeout_sec: Timeout) -> CancelGoal.Response:
        """Request to cancel a goal."""
        request = CancelGoal.Request(goal_info=GoalInfo(goal_id=goal_id))
        return await self._cancel.call(request, timeout_sec)

    async def result(self, goal_id: UUID, timeout_sec: Timeout) -> GoalResult[Any]:
        """Ask for the result of a goal, which any client may have sent."""
        request = self._types.get_result.Request(goal_id=goal_id)
        try:
            return goal_result(await self._results.call(request, timeout_sec))
        except ServiceTimeout as error:
            text = f"Action '{self.name}': goal {bytes(goal_id.uuid).hex()} has not ended in time"
            raise WaitTimeout(text) from error

    def _feedback_received(self, message: Any) -> Any:
        receiver = self.goals.get(bytes(message.goal_id.uuid))
        return None if receiver is None else receiver.feedback_received(message)

    def _status_received(self, message: GoalStatusArray) -> None:
        self.statuses = message.status_list
        if self.goals:
            for status in message.status_list:
                receiver = self.goals.get(bytes(status.goal_info.goal_id.uuid))
                # Another version may have states that this one does not know; they are skipped, not taken
                # for an error.
                if receiver is not None and status.status in STATES:
                    receiver.state_received(GoalState(status.status))

    def destroy(self) -> None:
        """Take the client out of service; goals in flight end with NodeDestroyed."""
        if self.destroyed:
            return
        super().destroy()
        for part in self._parts:
            part.destroy()


class ActionClient(Handle[ActionClientEndpoint], Generic[GoalT, ResultT, FeedbackT]):
    """Sends goals to an action server. Made by `Node.create_action_client`.

    Attributes:
        action_type: The action class.
        action_name: The full name of the action.
    """

    def __init__(self, context: NodeContext, action_type: type, name: str) -> None:
        action: Any = require_action(action_type)
        super().__init__(ActionClientEndpoint(context, action, name))
        self.action_type = action_type
        self.action_name = name
        self._goal_type: type[GoalT] = action.Goal

    @property
    def pending(self) -> int:
        """Goals that have been sent and have not ended."""
        return len(self._endpoint.goals)

    @property
    def statuses(self) -> list[GoalStatus]:
        """The states of all goals of the server, sent by any client, as it published them last.

        Clients that come late get them, too. Ended goals are in it for as long as the server keeps results.
        """
        return self._endpoint.statuses

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile | int,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Publish events of the action's three services, or stop doing so.

        Args:
            clock: Stamps the events.
            service_event_qos_profile: The topics'; a profile or a depth.
            introspection_state: OFF (as at first), METADATA, or CONTENTS.

        Raises:
            NodeDestroyed: The client has been destroyed.
            TypeError: `service_event_qos_profile` is neither a profile nor a depth.
            ValueError: The depth is negative, or there is no such state.
        """
        for each in self._endpoint.clients:
            each.configure_introspection(clock, service_event_qos_profile, introspection_state)

    def server_is_ready(self) -> bool:
        """Return whether a server is available now.

        Returns:
            True if all services and topics of the action are matched.
        """
        return self._endpoint.ready

    @must_await
    async def wait_for_server(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> bool:
        """Wait until a server of this action is available; the broker reports it at once.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            True if there is a server; False if there was none within `timeout_sec`.

        Raises:
            RuntimeError: The node does not run.
            NodeDestroyed: The client or its node has been destroyed.
            ServiceUnavailable: The broker refuses a part of the client; the text says why.
        """
        endpoint = self._endpoint

        def ready() -> bool:
            endpoint.require_alive()
            if not endpoint.ready:
                endpoint.require_not_refused()
            return endpoint.ready

        try:
            await endpoint.context.wait_until(ready, f"'{self.action_name}' has no server", timeout_sec)
        except WaitTimeout:
            return False
        return True

    @must_await
    async def send_goal(
        self,
        goal: GoalT,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: UUID | None = None,
        *,
        timeout_sec: Timeout = DEFAULT_TIMEOUT,
    ) -> ClientGoalHandle[ResultT, FeedbackT]:
        """Send a goal and wait until the server has accepted or rejected it.

        If the caller is cancelled meanwhile, the goal may have been accepted all the same.

        Args:
            goal: The goal message.
            feedback_callback: Gets each feedback message of this goal (`message.feedback`), `def` or
                `async def`; the first may come before this method returns. Without one, iterate over the
                handle.
            goal_uuid: The goal's id; None for a random one.
            timeout_sec: Seconds to wait for the answer at most; None for no limit.

        Returns:
            The goal. See `ClientGoalHandle.accepted`.

        Raises:
            TypeError: Not a goal message of this action; nothing was sent.
            InvalidMessageError: A field has a wrong type or is out of range; nothing was sent.
            ValueError: A goal with this id is in flight already.
            RuntimeError: The node does not run, or the callback does not take one argument.
            NodeDestroyed: The client or its node has been destroyed, before the call or during it.
            CallFailed: As for `Client.call`: ServiceUnavailable if there is no server, for example.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        if not isinstance(goal, self._goal_type):
            raise TypeError(f"Expected {self._goal_type.__qualname__}, got {type(goal).__qualname__}")
        if feedback_callback is not None:
            takes(feedback_callback, (1,), "feedback")
        goal_id = UUID(uuid=uuid.uuid4().bytes) if goal_uuid is None else goal_uuid
        receiver = GoalReceiver(goal_id, endpoint.name, feedback_callback)
        await endpoint.send(receiver, goal, timeout_sec)
        return ClientGoalHandle(receiver, endpoint)

    @must_await
    async def get_result(
        self, goal_uuid: UUID, timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> GoalResult[ResultT]:
        """Wait for the result of a goal that another client has sent, or this one before its link broke.

        Args:
            goal_uuid: The goal's id; `statuses` has those of all goals.
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            The terminal state and the result message.

        Raises:
            WaitTimeout: The goal has not ended within `timeout_sec`; it goes on.
            GoalUnknown: The server does not know the goal, or keeps its result no longer.
            CallFailed: As for `Client.call`.
        """
        return await self._endpoint.result(goal_uuid, timeout_sec)

    def destroy(self) -> None:
        """Take the client out of service; goals in flight end with NodeDestroyed."""
        super().destroy()
