"""A node's parameters for other nodes: services, and `/parameter_events`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.parameters.requests import ParameterRequests, event_message
from actors.ros.rclpy.node_parts import parts_of
from actors.ros.rclpy.qos import qos_profile_parameter_events

if TYPE_CHECKING:
    from actors.parameters.types import Parameter
    import threading
    from collections.abc import Callable

    from actors.parameters.changes import ParameterChanges
    from actors.parameters.store import ParameterStore
    from actors.ros.rclpy.clock import Clock
    from actors.ros.rclpy.publisher import Publisher
    from actors.ros.rclpy.qos import QoSProfile


class ServingNode(Protocol):
    """The part of a node that serves its parameters. A protocol, because nodes import this module."""

    def create_publisher(self, msg_type: type[Any], topic: str, qos_profile: QoSProfile, /) -> Publisher[Any]:
        """Create a publisher."""
        ...

    def create_service(self, srv_type: type[Any], srv_name: str, callback: Callable[..., Any], /) -> object:
        """Create a service."""
        ...

    def get_clock(self) -> Clock:
        """Return the clock."""
        ...

    def get_fully_qualified_name(self) -> str:
        """Return the name with its namespace."""
        ...


def publish_changes(node: ServingNode, store: ParameterStore) -> None:
    """Publish each change of the parameters, and tell the native node whether time is simulated."""
    events = node.create_publisher(ParameterEvent, "/parameter_events", qos_profile_parameter_events)

    events.lifeline = None  # the node's services have the store, and what publishes its changes
    parts, clock, name = parts_of(node), node.get_clock(), node.get_fully_qualified_name()
    thread, native = parts.thread, parts.native

    def set_native(parameter: Parameter) -> None:
        thread.call(lambda: native.set_parameters([parameter]))

    # Without the node and its parts, which have this function: they would never be without references.
    def publish(changes: ParameterChanges) -> None:
        events.publish(event_message(changes, clock.now().to_msg(), name))
        for each in (*changes.new, *changes.changed):
            if each.name == "use_sim_time":
                # callboard's node reads the time, and so must know; the other parameters are in this store
                # alone.
                set_native(each)

    store.listeners.append(publish)
    simulated = store.get("use_sim_time")
    if simulated.value:  # from an override, which is set before there are listeners
        set_native(simulated)


def serve_parameters(node: ServingNode, store: ParameterStore, lock: threading.RLock) -> None:
    """Let other nodes read and set the parameters; `lock` is held meanwhile."""

    def locked(handler: Callable[[Any], Any]) -> Callable[[Any, Any], Any]:
        def handle(request: Any, _response: Any) -> Any:
            # The same lock as for the node's own methods: a program may set parameters in a thread that
            # does not spin.
            with lock:
                return handler(request)

        return handle

    for name, srv_type, handler in ParameterRequests(store, _fits).handlers():
        # Services of this face, so that requests are handled where the executor spins, like every callback.
        node.create_service(srv_type, f"~/{name}", locked(handler))


def _fits(what: str, size: int) -> None:
    """Accept every size: the broker's limit is checked where the reply is sent."""
