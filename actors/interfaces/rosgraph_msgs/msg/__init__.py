"""Messages of rosgraph_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.rosgraph_msgs.msg._action import Action
    from actors.interfaces.rosgraph_msgs.msg._clock import Clock
    from actors.interfaces.rosgraph_msgs.msg._graph import Graph
    from actors.interfaces.rosgraph_msgs.msg._interface_type import InterfaceType
    from actors.interfaces.rosgraph_msgs.msg._node import Node
    from actors.interfaces.rosgraph_msgs.msg._qo_s_profile import QoSProfile
    from actors.interfaces.rosgraph_msgs.msg._service import Service
    from actors.interfaces.rosgraph_msgs.msg._topic import Topic
    from actors.interfaces.rosgraph_msgs.msg._type_hash import TypeHash

__all__ = [
    "Action",
    "Clock",
    "Graph",
    "InterfaceType",
    "Node",
    "QoSProfile",
    "Service",
    "Topic",
    "TypeHash",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Action": "_action",
            "Clock": "_clock",
            "Graph": "_graph",
            "InterfaceType": "_interface_type",
            "Node": "_node",
            "QoSProfile": "_qo_s_profile",
            "Service": "_service",
            "Topic": "_topic",
            "TypeHash": "_type_hash",
        },
    )
