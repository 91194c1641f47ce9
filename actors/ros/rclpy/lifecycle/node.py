"""Nodes with states. The callbacks run where `trigger_configure` etc. are called, or where the node spins."""

from __future__ import annotations

import threading
import traceback
from typing import TYPE_CHECKING, Any, TypeVar

from actors.interfaces.lifecycle_msgs.msg import TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.interfaces.message import Message
from actors.lifecycle.errors import InvalidTransitionError
from actors.lifecycle.requests import StateRequests, transition_event
from actors.lifecycle.states import CALLBACKS, StateMachine, TransitionCallbackReturn
from actors.ros.rclpy.lifecycle.managed_entity import ManagedEntity
from actors.ros.rclpy.lifecycle.publisher import LifecyclePublisher
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.lifecycle.states import LifecycleState, Transition
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.publisher import Publisher
    from actors.ros.rclpy.qos import QoSProfile

MsgT = TypeVar("MsgT", bound=Message)

__getattr__ = imported_names(__name__, "CallbackGroup QoSProfile Service")


class RclpyStateMachine(StateMachine):
    """callboard's state machine, with the state as programs read it from rclpy's: they have no other way."""

    @property
    def current_state(self) -> tuple[int, str]:
        """The number and the label of the state."""
        return self.current.state_id, self.current.label


class LifecycleNodeMixin(ManagedEntity):
    """Gives a class that is a `Node`, too, states that can be changed from outside.

    Call its `__init__` after `Node.__init__`. The callbacks `on_configure` etc. call those of the managed
    entities, until one does not succeed; override them, and call them from there.

    Args:
        enable_communication_interface: Serve `~/change_state`, `~/get_state`, `~/get_available_states`,
            `~/get_available_transitions` and `~/get_transition_graph`, and publish `~/transition_event`.
        callback_group: When the services may run; None for the node's default group.

    Raises:
        RuntimeError: The class is no Node.
        TypeError: `enable_communication_interface` is no bool.
    """

    def __init__(
        self, *, enable_communication_interface: bool = True, callback_group: CallbackGroup | None = None
    ) -> None:
        if not isinstance(self, Node):
            raise RuntimeError("LifecycleNodeMixin needs a Node: derive the class from rclpy.node.Node, too")  # noqa: TRY004 - rclpy's
        _require(enable_communication_interface, bool)
        self._state_machine = RclpyStateMachine()
        # The names have two underscores, which Python makes unique to this class: programs derive from it
        # and name their own attributes.
        self.__state_lock = threading.Lock()
        self._managed_entities: list[ManagedEntity] = []
        self.__transition_events: Publisher[TransitionEvent] | None = None
        if enable_communication_interface:
            self.__transition_events = self.create_publisher(TransitionEvent, "~/transition_event")
            self.create_service(
                ChangeState, "~/change_state", self.__serve_change_state, callback_group=callback_group
            )
            for name, srv_type, handler in StateRequests(self._state_machine).handlers():
                self.create_service(srv_type, f"~/{name}", _ignoring(handler), callback_group=callback_group)

    def add_managed_entity(self, entity: ManagedEntity) -> None:
        """Let an entity take part in the transitions.

        Raises:
            TypeError: It is no ManagedEntity.
        """
        _require(entity, ManagedEntity)
        if entity not in self._managed_entities:
            self._managed_entities.append(entity)

    def create_lifecycle_publisher(
        self, msg_type: type[MsgT], topic: str, qos_profile: QoSProfile | int, **options: Any
    ) -> LifecyclePublisher[MsgT]:
        """Make a publisher that is silent unless the node is active.

        Args:
            msg_type: The message class.
            topic: The topic's name.
            qos_profile: A profile or a depth.
            options: Further arguments of `Node.create_publisher`.

        Returns:
            The publisher.
        """
        assert isinstance(self, Node)
        publisher = self.create_publisher(
            msg_type, topic, qos_profile, publisher_class=LifecyclePublisher[MsgT], **options
        )
        assert isinstance(publisher, LifecyclePublisher)
        self.add_managed_entity(publisher)
        return publisher

    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher[Any]) -> bool:
        """Take a publisher out of service; return False if it is not this node's."""
        if publisher not in self._managed_entities:
            return False
        self._managed_entities.remove(publisher)
        assert isinstance(self, Node)
        return self.destroy_publisher(publisher)

    # Callbacks

    def __call_entities(self, name: str, state: LifecycleState) -> TransitionCallbackReturn:
        # A copy: a callback may add publishers.
        for entity in tuple(self._managed_entities):
            result = _checked(getattr(entity, name)(state), f"{type(entity).__name__}.{name}")
            if result is not TransitionCallbackReturn.SUCCESS:
                return result
        return TransitionCallbackReturn.SUCCESS

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_configure` of the managed entities."""
        return self.__call_entities("on_configure", state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_cleanup` of the managed entities."""
        return self.__call_entities("on_cleanup", state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_shutdown` of the managed entities."""
        return self.__call_entities("on_shutdown", state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_activate` of the managed entities, which lets lifecycle publishers publish."""
        return self.__call_entities("on_activate", state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_deactivate` of the managed entities, which silences lifecycle publishers."""
        return self.__call_entities("on_deactivate", state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Call `on_error` of the managed entities."""
        return self.__call_entities("on_error", state)

    # Transitions: each returns what its callback has returned, and ERROR in a state that does not have it

    def trigger_configure(self) -> TransitionCallbackReturn:
        """Go from unconfigured to inactive."""
        return self.__change_state("configure")

    def trigger_cleanup(self) -> TransitionCallbackReturn:
        """Go from inactive to unconfigured."""
        return self.__change_state("cleanup")

    def trigger_activate(self) -> TransitionCallbackReturn:
        """Go from inactive to active."""
        return self.__change_state("activate")

    def trigger_deactivate(self) -> TransitionCallbackReturn:
        """Go from active to inactive."""
        return self.__change_state("deactivate")

    def trigger_shutdown(self) -> TransitionCallbackReturn:
        """Go from unconfigured, inactive or active to finalized, which has no way back."""
        return self.__change_state("shutdown")

    def __change_state(self, wanted: int | str) -> TransitionCallbackReturn:
        try:
            # Only for the first step, into a transition state, where every other request is refused. The
            # callback runs without it, since it may ask for the state.
            with self.__state_lock:
                start = self._state_machine.current
                transition = self._state_machine.request(wanted)
        except InvalidTransitionError as error:
            assert isinstance(self, Node)
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.ERROR
        self.__publish_transition(transition)
        result = self.__call_back(start)
        self.__publish_transition(self._state_machine.finish(result))
        if result is TransitionCallbackReturn.ERROR:
            # `on_error` runs once, whatever it returns: there is no error of an error.
            self.__publish_transition(self._state_machine.finish(self.__call_back(start)))
        return result

    def __call_back(self, start: LifecycleState) -> TransitionCallbackReturn:
        """Run the callback of the current state; return ERROR if it raises."""
        name = CALLBACKS[self._state_machine.current]
        try:
            return _checked(getattr(self, name)(start), name)
        except Exception:  # noqa: BLE001 - the user's: it decides the next state
            assert isinstance(self, Node)
            self.get_logger().error(f"{name} has raised:\n{traceback.format_exc()}")
            return TransitionCallbackReturn.ERROR

    def __publish_transition(self, transition: Transition) -> None:
        if self.__transition_events is not None:
            assert isinstance(self, Node)
            now = self.get_clock().now().nanoseconds
            self.__transition_events.publish(transition_event(transition, now))

    def __serve_change_state(  # pyright: ignore[reportUnusedFunction] - `__init__` uses it
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        wanted = request.transition
        result = self.__change_state(wanted.label or wanted.id)
        response.success = result is TransitionCallbackReturn.SUCCESS
        return response


class LifecycleNode(LifecycleNodeMixin, Node):
    """A node that is configured, activated and shut down from outside, or by its own `trigger_configure` etc.

    Args:
        node_name: As for `Node`.
        enable_communication_interface: As for `LifecycleNodeMixin`.
        options: All other arguments of `Node`.
    """

    def __init__(
        self, node_name: str, *, enable_communication_interface: bool = True, **options: Any
    ) -> None:
        Node.__init__(self, node_name, **options)
        LifecycleNodeMixin.__init__(self, enable_communication_interface=enable_communication_interface)


def _require(value: object, kind: type) -> None:
    if not isinstance(value, kind):
        raise TypeError(f"{value!r} is no {kind.__name__}")


def _ignoring(handler: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
    def handle(request: Any, response: Any) -> Any:
        del response
        return handler(request)

    return handle


def _checked(result: object, what: str) -> TransitionCallbackReturn:
    if isinstance(result, TransitionCallbackReturn):
        return result
    raise TypeError(f"{what} returned {result!r}, not a TransitionCallbackReturn")
