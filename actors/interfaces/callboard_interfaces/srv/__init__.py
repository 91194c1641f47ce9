"""Services of callboard_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.callboard_interfaces.srv._get_diagnostics import GetDiagnostics

__all__ = [
    "GetDiagnostics",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "GetDiagnostics": "_get_diagnostics",
        },
    )
