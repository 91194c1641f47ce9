"""Messages of diagnostic_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.diagnostic_msgs.msg._diagnostic_array import DiagnosticArray
    from actors.interfaces.diagnostic_msgs.msg._diagnostic_status import DiagnosticStatus
    from actors.interfaces.diagnostic_msgs.msg._key_value import KeyValue

__all__ = [
    "DiagnosticArray",
    "DiagnosticStatus",
    "KeyValue",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "DiagnosticArray": "_diagnostic_array",
            "DiagnosticStatus": "_diagnostic_status",
            "KeyValue": "_key_value",
        },
    )
