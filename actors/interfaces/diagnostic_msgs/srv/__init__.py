"""Services of diagnostic_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.diagnostic_msgs.srv._add_diagnostics import AddDiagnostics
    from actors.interfaces.diagnostic_msgs.srv._self_test import SelfTest

__all__ = [
    "AddDiagnostics",
    "SelfTest",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "AddDiagnostics": "_add_diagnostics",
            "SelfTest": "_self_test",
        },
    )
