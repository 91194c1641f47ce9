"""Message classes by their types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.ros.rosidl_runtime_py.utilities import get_message

if TYPE_CHECKING:
    from actors.interfaces.slot_types import NamespacedType


def import_message_from_namespaced_type(message_type: NamespacedType) -> Any:
    """Return the class of a type that another message contains.

    Raises:
        ValueError: It is no type of a message file.
        AttributeError: There is no such message.
        ModuleNotFoundError: There is no such package.
    """
    return get_message("/".join(message_type.namespaced_name()))
