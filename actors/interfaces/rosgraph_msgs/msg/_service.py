"""rosgraph_msgs/msg/Service."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rosgraph_msgs.msg._interface_type import InterfaceType
from actors.interfaces.rosgraph_msgs.msg._qo_s_profile import QoSProfile


class Service(Message, type_name="rosgraph_msgs/msg/Service"):
    """rosgraph_msgs/msg/Service."""

    name: str = ""
    request_type: InterfaceType = msgspec.field(default_factory=InterfaceType)
    request_qos: QoSProfile = msgspec.field(default_factory=QoSProfile)
    response_type: InterfaceType = msgspec.field(default_factory=InterfaceType)
    response_qos: QoSProfile = msgspec.field(default_factory=QoSProfile)
