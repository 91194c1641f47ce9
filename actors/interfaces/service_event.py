"""The message of service introspection: ROS's `<Service>_Event`.

Every service type has one, such as `AddTwoInts.Event`. It is part of the service's definition, and so of its
hash. The class is made on first use.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar, cast

from actors.interfaces.message import Message, Service, message_class, type_name
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from actors.interfaces.types import AtMost

if TYPE_CHECKING:
    import msgspec

    from actors.interfaces.message import ServiceType

RequestT = TypeVar("RequestT", bound=Message)
ResponseT = TypeVar("ResponseT", bound=Message)


if TYPE_CHECKING:

    class ServiceEvent(Message, Generic[RequestT, ResponseT]):
        """Type of an event class for type checkers."""

        info: ServiceEventInfo = msgspec.field(default_factory=ServiceEventInfo)
        """The kind of event, its time, and its call."""
        request: list[RequestT] = msgspec.field(default_factory=list[RequestT])
        """The request, in events about one with contents."""
        response: list[ResponseT] = msgspec.field(default_factory=list[ResponseT])
        """The response, in events about one with contents."""


def service_event(
    srv_type: type[ServiceType[RequestT, ResponseT]],
) -> type[ServiceEvent[RequestT, ResponseT]]:
    """Return the event class of a service class; it is made once.

    Raises:
        TypeError: `srv_type` is not a service class.
    """
    return cast("type[ServiceEvent[RequestT, ResponseT]]", _event(srv_type))


@cache
def _event(srv_type: Any) -> type[Message]:
    if not (isinstance(srv_type, type) and issubclass(srv_type, Service)) or srv_type is Service:
        raise TypeError(
            f"Expected a service class, such as example_interfaces.srv.AddTwoInts; got {srv_type!r}"
        )
    parts: Any = srv_type
    made = message_class(
        srv_type,
        f"{type_name(srv_type)}_Event",
        {
            "info": (ServiceEventInfo, ServiceEventInfo),
            "request": (Annotated[list[parts.Request], AtMost(1)], list),
            "response": (Annotated[list[parts.Response], AtMost(1)], list),
        },
    )
    # Where pickle looks for it: "SetBool.Event", or "SetBool_Event" where the request is "SetBool_Request".
    made.__qualname__ = parts.Request.__qualname__.removesuffix("Request") + "Event"
    return made
