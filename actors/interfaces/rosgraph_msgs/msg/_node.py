"""rosgraph_msgs/msg/Node."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg._parameter_descriptor import ParameterDescriptor
from actors.interfaces.rcl_interfaces.msg._parameter_value import ParameterValue
from actors.interfaces.rosgraph_msgs.msg._action import Action as RosgraphMsgsAction
from actors.interfaces.rosgraph_msgs.msg._service import Service as RosgraphMsgsService
from actors.interfaces.rosgraph_msgs.msg._topic import Topic


class Node(Message, type_name="rosgraph_msgs/msg/Node"):
    """rosgraph_msgs/msg/Node."""

    name: str = ""
    parameters: list[ParameterDescriptor] = msgspec.field(default_factory=list[ParameterDescriptor])
    parameter_values: list[ParameterValue] = msgspec.field(default_factory=list[ParameterValue])
    publishers: list[Topic] = msgspec.field(default_factory=list[Topic])
    subscriptions: list[Topic] = msgspec.field(default_factory=list[Topic])
    service_clients: list[RosgraphMsgsService] = msgspec.field(default_factory=list[RosgraphMsgsService])
    service_servers: list[RosgraphMsgsService] = msgspec.field(default_factory=list[RosgraphMsgsService])
    action_clients: list[RosgraphMsgsAction] = msgspec.field(default_factory=list[RosgraphMsgsAction])
    action_servers: list[RosgraphMsgsAction] = msgspec.field(default_factory=list[RosgraphMsgsAction])
