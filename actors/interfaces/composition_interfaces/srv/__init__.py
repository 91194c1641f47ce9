"""Services of composition_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.composition_interfaces.srv._list_nodes import ListNodes
    from actors.interfaces.composition_interfaces.srv._load_node import LoadNode
    from actors.interfaces.composition_interfaces.srv._unload_node import UnloadNode

__all__ = [
    "ListNodes",
    "LoadNode",
    "UnloadNode",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ListNodes": "_list_nodes",
            "LoadNode": "_load_node",
            "UnloadNode": "_unload_node",
        },
    )
