"""Interface classes by name, as `import` finds them."""

from __future__ import annotations

from typing import Any

from actors.interfaces.action import is_action_type
from actors.interfaces.message import Service, is_message_type
from actors.interfaces.slot_types import NamespacedType
from actors.ros.rosidl_runtime_py.import_message import import_message_from_namespaced_type

_PARTS = 3
"""Of a name: the package, the kind and the type."""


def get_namespaced_type(identifier: str) -> NamespacedType:
    """Return the type of an interface: "std_msgs/msg/String".

    Raises:
        ValueError: This is no such name.
    """
    return _namespaced_type(identifier, "")


def get_message_namespaced_type(identifier: str) -> NamespacedType:
    """Return the type of a message: "std_msgs/msg/String" or "std_msgs/String".

    Raises:
        ValueError: This is no such name.
    """
    return _namespaced_type(identifier, "msg")


def get_service_namespaced_type(identifier: str) -> NamespacedType:
    """Return the type of a service: "std_srvs/srv/SetBool" or "std_srvs/SetBool".

    Raises:
        ValueError: This is no such name.
    """
    return _namespaced_type(identifier, "srv")


def get_action_namespaced_type(identifier: str) -> NamespacedType:
    """Return the type of an action: "nav2_msgs/action/Spin" or "nav2_msgs/Spin".

    Raises:
        ValueError: This is no such name.
    """
    return _namespaced_type(identifier, "action")


def get_interface(identifier: str) -> Any:
    """Return the class of an interface.

    Args:
        identifier: Its name, such as "std_msgs/msg/String".

    Raises:
        ValueError: This is no such name.
        AttributeError: The package has no such interface.
        ModuleNotFoundError: There is no such package.
    """
    return import_message_from_namespaced_type(get_namespaced_type(identifier))


def get_message(identifier: str) -> Any:
    """Return the class of a message: "std_msgs/msg/String".

    Raises:
        ValueError: This is no name of a message.
        AttributeError: The package has no such message.
        ModuleNotFoundError: There is no such package.
    """
    interface = import_message_from_namespaced_type(get_message_namespaced_type(identifier))
    if not is_message(interface):
        raise ValueError(f"Expected the name of a message; got '{identifier}'")
    return interface


def get_service(identifier: str) -> Any:
    """Return the class of a service: "std_srvs/srv/SetBool".

    Raises:
        ValueError: This is no name of a service.
        AttributeError: The package has no such service.
        ModuleNotFoundError: There is no such package.
    """
    interface = import_message_from_namespaced_type(get_service_namespaced_type(identifier))
    if not is_service(interface):
        raise ValueError(f"Expected the name of a service; got '{identifier}'")
    return interface


def get_action(identifier: str) -> Any:
    """Return the class of an action: "example_interfaces/action/Fibonacci".

    Raises:
        ValueError: This is no name of an action.
        AttributeError: The package has no such action.
        ModuleNotFoundError: There is no such package.
    """
    interface = import_message_from_namespaced_type(get_action_namespaced_type(identifier))
    if not is_action(interface):
        raise ValueError(f"Expected the name of an action; got '{identifier}'")
    return interface


def is_message(interface: object) -> bool:
    """Return whether this is a message class."""
    return is_message_type(interface)


def is_service(interface: object) -> bool:
    """Return whether this is a service class."""
    return isinstance(interface, type) and issubclass(interface, Service) and interface is not Service


def is_action(interface: object) -> bool:
    """Return whether this is an action class."""
    return is_action_type(interface)


def _namespaced_type(identifier: str, kind: str) -> NamespacedType:
    parts = identifier.split("/")
    if len(parts) == _PARTS - 1:
        parts.insert(1, kind)
    if len(parts) != _PARTS or not all(parts):
        raise ValueError(
            f"Expected the name of an interface, such as std_msgs/msg/String; got '{identifier}'"
        )
    return NamespacedType(parts[:-1], parts[-1])
