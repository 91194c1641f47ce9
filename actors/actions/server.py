"""The action server as users hold it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic

from actors.actions.server_callbacks import (
    ServerCallbacks,
    accept_goal,
    execute_at_once,
    reject_cancel,
)
from actors.actions.server_endpoint import ActionServerEndpoint
from actors.actions.server_goal import FeedbackT, GoalT, ResultT
from actors.endpoints.endpoint import Handle

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.context import NodeContext
    from actors.endpoints.service_introspection import ServiceIntrospectionState
    from actors.qos.profile import QoSProfile
    from actors.time.clock import Clock


class ActionServer(Handle[ActionServerEndpoint], Generic[GoalT, ResultT, FeedbackT]):
    """Executes goals. Made by `Node.create_action_server`.

    Attributes:
        action_type: The action class.
        action_name: The full name of the action.
    """

    def __init__(
        self,
        context: NodeContext,
        action_type: type,
        name: str,
        execute_callback: Callable[..., Any],
        *,
        goal_callback: Callable[..., Any] | None,
        cancel_callback: Callable[..., Any] | None,
        handle_accepted_callback: Callable[..., Any] | None,
        result_timeout_sec: float,
        cancel_execution: bool,
    ) -> None:
        callbacks = ServerCallbacks(
            execute=execute_callback,
            goal=goal_callback or accept_goal,
            cancel=cancel_callback or reject_cancel,
            handle_accepted=handle_accepted_callback or execute_at_once,
        )
        super().__init__(
            ActionServerEndpoint(
                context,
                action_type,
                name,
                callbacks,
                result_timeout_sec=result_timeout_sec,
                cancel_execution=cancel_execution,
            )
        )
        self.action_type = action_type
        self.action_name = name

    @property
    def refusal(self) -> str:
        """Why the broker of this session has refused a part of the server; "" if it has not, or not yet.

        The parts are three services and two topics. Rules that a broker reads later may refuse one at any
        time.
        """
        return self._endpoint.part_refusal

    @property
    def active(self) -> int:
        """Goals that have been accepted and have not ended."""
        return len(self._endpoint.goals)

    @property
    def refused(self) -> int:
        """Goals rejected so far because 1000 goals of this server had not ended."""
        return self._endpoint.refused_goals

    @property
    def results_dropped(self) -> int:
        """Results dropped before `result_timeout_sec` because 1000 results or 16 MiB of them were kept."""
        return self._endpoint.results.dropped

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
            NodeDestroyed: The server has been destroyed.
            TypeError: `service_event_qos_profile` is neither a profile nor a depth.
            ValueError: The depth is negative, or there is no such state.
        """
        for each in self._endpoint.services:
            each.configure_introspection(clock, service_event_qos_profile, introspection_state)

    def destroy(self) -> None:
        """Take the server out of service: execute callbacks are cancelled, clients get ServiceUnavailable."""
        super().destroy()
