"""A node with states, as rclpy's `LifecycleNode`."""

from __future__ import annotations

from collections.abc import Awaitable
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from actors.callbacks.must_await import must_await
from actors.interfaces.message import Message
from actors.lifecycle.publisher import LifecyclePublisher
from actors.lifecycle.states import TransitionCallbackReturn
from actors.lifecycle.transitions import Transitions
from actors.node.node import Node

if TYPE_CHECKING:
    from actors.endpoints.events import PublisherEventCallbacks
    from actors.lifecycle.states import LifecycleState
    from actors.node.qos_overrides import QoSOverridingOptions
    from actors.qos.profile import QoSProfile

MessageT = TypeVar("MessageT", bound=Message)

CallbackResult: TypeAlias = TransitionCallbackReturn | Awaitable[TransitionCallbackReturn]
"""The return value of a transition's callback, which may be `def` or `async def`."""


class LifecycleNode(Node):
    """A node that is configured, activated and shut down from outside, or by its own `trigger_configure` etc.

    Override `on_configure` etc., as `def` or `async def`. Each gets the state that the node was in. If one
    raises, the effect is as if it returned ERROR: `on_error` follows. While a coroutine waits, the node's
    other callbacks run, and further transitions are refused.

    Args:
        node_name: As for `Node`.
        enable_communication_interface: Serve `~/change_state`, `~/get_state`, `~/get_available_states`,
            `~/get_available_transitions` and `~/get_transition_graph`, and publish `~/transition_event`.
        arguments: All other arguments of `Node`, `options` and its keywords included.

    Raises:
        CallboardError, ValueError, TypeError, RuntimeError: As `Node`.
    """

    def __init__(
        self, node_name: str, *, enable_communication_interface: bool = True, **arguments: Any
    ) -> None:
        super().__init__(node_name, **arguments)
        self._transitions = Transitions(self, self._context)
        if enable_communication_interface:
            self._transitions.serve()

    @property
    def current_state(self) -> LifecycleState:
        """The state that the node is in."""
        return self._transitions.machine.current

    def create_lifecycle_publisher(
        self,
        msg_type: type[MessageT],
        topic: str,
        qos_profile: QoSProfile | int = 10,
        *,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        strict_qos: bool | None = None,
    ) -> LifecyclePublisher[MessageT]:
        """Make a publisher that is silent unless the node is active.

        Args:
            msg_type: As for `create_publisher`.
            topic: As for `create_publisher`.
            qos_profile: As for `create_publisher`.
            event_callbacks: As for `create_publisher`.
            qos_overriding_options: As for `create_publisher`.
            strict_qos: As for `create_publisher`.

        Returns:
            The publisher; `destroy_publisher` destroys it.

        Raises:
            CallboardError, TypeError, ValueError: As `create_publisher`.
        """
        name, qos = self._topic_and_qos(topic, qos_profile, qos_overriding_options, "publisher")
        return LifecyclePublisher(
            self._context,
            msg_type,
            name,
            qos,
            event_callbacks,
            activation=self._transitions.activation,
            strict_qos=strict_qos,
        )

    # Callbacks

    def on_configure(self, state: LifecycleState) -> CallbackResult:
        """Configure the node; override it to read parameters and make publishers.

        Args:
            state: The state that the node was in.

        Returns:
            SUCCESS: inactive; FAILURE: still unconfigured; ERROR: `on_error` follows.
        """
        del state
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> CallbackResult:
        """Undo `on_configure`.

        Args:
            state: The state that the node was in.

        Returns:
            SUCCESS: unconfigured; FAILURE: still inactive; ERROR: `on_error` follows.
        """
        del state
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> CallbackResult:
        """Begin to work. Lifecycle publishers publish after its success; this default enables them at once.

        Args:
            state: The state that the node was in.

        Returns:
            SUCCESS: active; FAILURE: still inactive; ERROR: `on_error` follows.
        """
        del state
        # Before the end of the transition, so that a subclass may publish in `on_activate` after calling
        # this.
        self._transitions.activation.active = True
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> CallbackResult:
        """Stop working. Lifecycle publishers are silent after its success; this default stops them at once.

        Args:
            state: The state that the node was in.

        Returns:
            SUCCESS: inactive; FAILURE: still active; ERROR: `on_error` follows.
        """
        del state
        self._transitions.activation.active = False
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> CallbackResult:
        """Release everything for good.

        Args:
            state: The state that the node was in.

        Returns:
            SUCCESS or FAILURE: finalized; ERROR: `on_error` follows.
        """
        del state
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> CallbackResult:
        """Clean up after another callback has returned ERROR or raised.

        Args:
            state: The state that the node was in before the transition.

        Returns:
            SUCCESS: unconfigured; FAILURE or ERROR: finalized.
        """
        del state
        return TransitionCallbackReturn.SUCCESS

    # Transitions

    @must_await
    async def trigger_configure(self) -> TransitionCallbackReturn:
        """Go from unconfigured to inactive.

        Returns:
            The result of `on_configure`; ERROR if it raised.

        Raises:
            InvalidTransitionError: The node is in another state, or a transition runs.
            RuntimeError: The node does not run.
            NodeDestroyed: The node was stopped before the end.
        """
        return await self._transitions.request("configure")

    @must_await
    async def trigger_cleanup(self) -> TransitionCallbackReturn:
        """Go from inactive to unconfigured.

        Returns:
            The result of `on_cleanup`; ERROR if it raised.

        Raises:
            InvalidTransitionError, RuntimeError, NodeDestroyed: As `trigger_configure`.
        """
        return await self._transitions.request("cleanup")

    @must_await
    async def trigger_activate(self) -> TransitionCallbackReturn:
        """Go from inactive to active.

        Returns:
            The result of `on_activate`; ERROR if it raised.

        Raises:
            InvalidTransitionError, RuntimeError, NodeDestroyed: As `trigger_configure`.
        """
        return await self._transitions.request("activate")

    @must_await
    async def trigger_deactivate(self) -> TransitionCallbackReturn:
        """Go from active to inactive.

        Returns:
            The result of `on_deactivate`; ERROR if it raised.

        Raises:
            InvalidTransitionError, RuntimeError, NodeDestroyed: As `trigger_configure`.
        """
        return await self._transitions.request("deactivate")

    @must_await
    async def trigger_shutdown(self) -> TransitionCallbackReturn:
        """Go from unconfigured, inactive or active to finalized, which has no way back.

        Returns:
            The result of `on_shutdown`; ERROR if it raised.

        Raises:
            InvalidTransitionError, RuntimeError, NodeDestroyed: As `trigger_configure`.
        """
        return await self._transitions.request("shutdown")
