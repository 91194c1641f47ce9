"""Messages of service_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.service_msgs.msg._service_event_info import ServiceEventInfo

__all__ = [
    "ServiceEventInfo",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ServiceEventInfo": "_service_event_info",
        },
    )
