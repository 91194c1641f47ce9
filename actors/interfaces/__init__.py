"""Message types: the standard packages, and the tools that define, parse and generate them.

Imports proto only. The generated packages in it import its `message` module and each other.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.interfaces.codec import Codec, codec_for, decode_untyped
    from actors.interfaces.errors import (
        InterfaceSyntaxError,
        InvalidMessageError,
        MessageBudgetError,
        UnknownInterfaceError,
    )
    from actors.interfaces.generator import generate
    from actors.interfaces.message import Action, Message, Service, type_hash, type_name
    from actors.interfaces.registry import find_interface, interface_source

__all__ = [
    "Action",
    "Codec",
    "InterfaceSyntaxError",
    "InvalidMessageError",
    "Message",
    "MessageBudgetError",
    "Service",
    "UnknownInterfaceError",
    "codec_for",
    "decode_untyped",
    "find_interface",
    "generate",
    "interface_source",
    "type_hash",
    "type_name",
]

if not TYPE_CHECKING:
    from actors.interfaces.lazy import lazy_exports

    __getattr__ = lazy_exports(
        __name__,
        {
            "Action": "message",
            "Codec": "codec",
            "InterfaceSyntaxError": "errors",
            "InvalidMessageError": "errors",
            "MessageBudgetError": "errors",
            "Message": "message",
            "Service": "message",
            "UnknownInterfaceError": "errors",
            "codec_for": "codec",
            "decode_untyped": "codec",
            "generate": "generator",
            "find_interface": "registry",
            "interface_source": "registry",
            "type_hash": "message",
            "type_name": "message",
        },
    )
