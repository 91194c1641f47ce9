"""A node's parameters for other nodes: ROS 2's six services, and the topic `/parameter_events`.

The handlers run through the mailbox, because they call the user's callbacks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.publisher.publisher import Publisher
from actors.endpoints.service.idle import IdleService
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.parameters.requests import ParameterRequests, event_message
from actors.qos.profile import qos_profile_parameter_events
from proto.errors import InvalidServiceNameError

if TYPE_CHECKING:
    from actors.arguments.remapping import Remapper
    from actors.endpoints.context import NodeContext
    from actors.parameters.changes import ParameterChanges
    from actors.parameters.store import ParameterStore

EVENTS_TOPIC: Final = "/parameter_events"


class ParameterServices:
    """The parameter services of one node, and its publisher of `/parameter_events`.

    Args:
        context: The node.
        names: Expands and remaps the names.
        parameters: The node's parameters.
    """

    def __init__(self, context: NodeContext, names: Remapper, parameters: ParameterStore) -> None:
        self._context = context
        try:
            for name, srv_type, callback in ParameterRequests(
                parameters, context.link.require_fits
            ).handlers():
                full_name = names.resolve_service(f"~/{name}")
                IdleService(context, srv_type, full_name, callback=callback, concurrent=False)
        except InvalidServiceNameError as error:
            context.log.warning(f"The node's name is too long for parameter services: {error}")
        topic = names.resolve_topic(EVENTS_TOPIC)
        self._events = Publisher(context, ParameterEvent, topic, qos_profile_parameter_events)
        # Every node has it, so that warnings about publishers without subscriptions leave it out.
        endpoint_of(self._events).standard = True
        # A listener and not a post-set callback: users can remove those, and one of theirs that raises
        # would keep the event from being published.
        parameters.listeners.append(self._publish)

    def _publish(self, changes: ParameterChanges) -> None:
        # Parameters of a node that has ended may still be set; that is not published.
        if self._events.destroyed:
            return
        stamp = self._context.clock.now().to_msg()
        try:
            self._events.publish(event_message(changes, stamp, self._context.full_name))
        except InvalidMessageError as error:  # too large for the broker: the value is set all the same
            self._context.log.warning(f"A change of parameters was not published: {error}")
