"""rosgraph_msgs/msg/Topic."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rosgraph_msgs.msg._interface_type import InterfaceType
from actors.interfaces.rosgraph_msgs.msg._qo_s_profile import QoSProfile


class Topic(Message, type_name="rosgraph_msgs/msg/Topic"):
    """rosgraph_msgs/msg/Topic."""

    name: str = ""
    type: InterfaceType = msgspec.field(default_factory=InterfaceType)
    qos: QoSProfile = msgspec.field(default_factory=QoSProfile)
