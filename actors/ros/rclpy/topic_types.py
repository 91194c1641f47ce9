"""The types of topics: as with ROS 2, a topic has one type in a context, for all nodes there."""

from __future__ import annotations

import threading
from weakref import WeakValueDictionary

from actors.interfaces.naming import message_name
from actors.ros.rclpy._rclpy_pybind11 import RCLError


class TypeClaim:
    """The type of a topic, as long as a publisher or a subscription keeps this.

    Args:
        type_name: The type's name.
    """

    def __init__(self, type_name: str) -> None:
        self.type_name = type_name


class TopicTypes:
    """The types of the topics of a context."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._claims: WeakValueDictionary[str, TypeClaim] = WeakValueDictionary()

    def claim(self, topic: str, msg_type: type) -> TypeClaim:
        """Return what a publisher or subscription keeps until it is destroyed.

        Args:
            topic: The topic's full name.
            msg_type: The class of its messages.

        Raises:
            RCLError: The topic has another type.
        """
        name = message_name(msg_type)
        with self._lock:
            claim = self._claims.setdefault(topic, TypeClaim(name))
        if claim.type_name != name:
            raise RCLError(f"'{topic}' has the type {claim.type_name} in this context, and cannot get {name}")
        return claim
