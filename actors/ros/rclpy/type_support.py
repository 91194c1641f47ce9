"""Checks of message, service and action classes."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar, cast

from actors.interfaces.message import Message
from actors.interfaces.message import is_message_type
from actors.ros.rclpy.exceptions import NoTypeSupportImportedException

Msg: TypeAlias = Message

MsgT = TypeVar("MsgT", bound=Msg)
SrvT = TypeVar("SrvT")
SrvRequestT = TypeVar("SrvRequestT")
SrvResponseT = TypeVar("SrvResponseT")
SrvEventT = TypeVar("SrvEventT")
MsgType = TypeVar("MsgType")
SrvType = TypeVar("SrvType")
SrvTypeRequest = TypeVar("SrvTypeRequest")
SrvTypeResponse = TypeVar("SrvTypeResponse")
"""The last four: older names, which programs import from the modules that have used them."""


def _is_service_type(srv_type: Any) -> bool:
    return all(is_message_type(getattr(srv_type, name, None)) for name in ("Request", "Response"))


def _is_action_type(action_type: Any) -> bool:
    return all(is_message_type(getattr(action_type, name, None)) for name in ("Goal", "Result", "Feedback"))


def check_for_type_support(msg_or_srv_type: Any) -> None:
    """Check that something is a message, service or action class.

    Raises:
        NoTypeSupportImportedException: It is a class that ROS 2 generated, without its C code.
        AttributeError: It is something else.
    """
    if any(check(msg_or_srv_type) for check in (is_message_type, _is_service_type, _is_action_type)):
        return
    metaclass = cast("type[object]", type(msg_or_srv_type))
    is_generated = hasattr(metaclass, "__import_type_support__")
    error = NoTypeSupportImportedException if is_generated else AttributeError
    raise error(f"{msg_or_srv_type!r} is no message, service or action class")


def check_is_valid_msg_type(msg_type: Any) -> None:
    """Raise RuntimeError unless it is a message class."""
    if not is_message_type(msg_type):
        raise RuntimeError(f"{msg_type!r} is no message class: import one such as std_msgs.msg.String")


def check_is_valid_srv_type(srv_type: Any) -> None:
    """Raise RuntimeError unless it is a service class."""
    if not _is_service_type(srv_type):
        raise RuntimeError(f"{srv_type!r} is no service class: import one such as std_srvs.srv.Empty")
