"""Interface classes by name, as `import` finds them."""

from __future__ import annotations

import importlib
from typing import Any

from actors.interfaces.action import is_action_type
from actors.interfaces.message import Service, is_message_type


def get_interface(identifier: str) -> Any:
    """Return the class of an interface.

    Args:
        identifier: Its name, such as "std_msgs/msg/String".

    Raises:
        ValueError: This is no such name.
        AttributeError: The package has no such interface.
        ModuleNotFoundError: There is no such package.
    """
    package, *kind, name = identifier.split("/")
    if len(kind) != 1 or not (package and kind[0] and name):
        raise ValueError(
            f"Expected the name of an interface, such as std_msgs/msg/String; got '{identifier}'"
        )
    return getattr(importlib.import_module(f"{package}.{kind[0]}"), name)


def get_message(identifier: str) -> Any:
    """Return the class of a message: "std_msgs/msg/String".

    Raises:
        ValueError: This is no name of a message.
        AttributeError: The package has no such message.
        ModuleNotFoundError: There is no such package.
    """
    interface = get_interface(identifier)
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
    interface = get_interface(identifier)
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
    interface = get_interface(identifier)
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
