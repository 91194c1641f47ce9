"""Classes of interfaces by their types."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actors.interfaces.slot_types import NamespacedType


def import_message_from_namespaced_type(message_type: NamespacedType) -> Any:
    """Return the class of a type, such as one that a message contains.

    Raises:
        AttributeError: There is no such interface.
        ModuleNotFoundError: There is no such package.
    """
    return getattr(importlib.import_module(".".join(message_type.namespaces)), message_type.name)
