"""Actions of test_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.test_msgs.action._fibonacci import Fibonacci
    from actors.interfaces.test_msgs.action._nested_message import NestedMessage

__all__ = [
    "Fibonacci",
    "NestedMessage",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Fibonacci": "_fibonacci",
            "NestedMessage": "_nested_message",
        },
    )
