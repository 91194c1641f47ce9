"""Callbacks that fit, and those that do not: mypy reports an ignored error that is none any more.

`test_type_checkers.py` shows it to pyright, which must report the same lines.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_srvs.srv import Trigger

if TYPE_CHECKING:
    import actors
    from actors.interfaces.std_msgs.msg import String


def on_scan(scan: LaserScan) -> None:
    """Take a message."""


def on_scan_with_info(scan: LaserScan, info: actors.MessageInfo) -> None:
    """Take a message and its info."""


async def on_scan_later(scan: LaserScan) -> None:
    """Take a message, and await something."""


def on_anything(message: Any) -> None:
    """Take any message."""


def on_text(text: String) -> None:
    """Take another message."""


def on_nothing() -> None:
    """Take nothing."""


def on_scan_with_number(scan: LaserScan, number: int) -> None:
    """Take something else than the info."""


def answer(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
    """Fill in the response, as in ROS 2."""
    del request
    return response


async def answer_later(request: Trigger.Request) -> Trigger.Response:
    """Make the response."""
    del request
    return Trigger.Response()


def answer_nothing(request: Trigger.Request) -> None:
    """Forget the response."""


def answer_another(request: Trigger.Response) -> Trigger.Response:
    """Take something else than a request."""
    return request


def answer_bytes(request: bytes) -> bytes:
    """Make an encoded response."""
    return request


def use(node: actors.Node) -> actors.Subscription[LaserScan]:
    """Make subscriptions and services."""
    scans: list[LaserScan] = []
    node.create_subscription(LaserScan, "scan", on_scan)
    node.create_subscription(LaserScan, "scan", on_scan_with_info, 10)
    node.create_subscription(LaserScan, "scan", on_scan_later, concurrent=True)
    node.create_subscription(LaserScan, "scan", on_anything)
    node.create_subscription(LaserScan, "scan", scans.append)
    node.create_subscription(LaserScan, "scan", print)
    node.create_subscription(None, "scan", on_text, raw=True)
    node.create_subscription(LaserScan, "scan", on_text)  # type: ignore[arg-type]
    node.create_subscription(LaserScan, "scan", on_nothing)  # type: ignore[arg-type]
    node.create_subscription(LaserScan, "scan", on_scan_with_number)  # type: ignore[arg-type]
    node.create_service(Trigger, "do", answer)
    node.create_service(Trigger, "do", answer_later)
    node.create_service(Trigger, "do", lambda request, response: response)
    node.create_service(Trigger, "do", answer_nothing)  # type: ignore[arg-type]
    node.create_service(Trigger, "do", answer_another)  # type: ignore[arg-type]
    node.create_service(Trigger, "do", answer_bytes, raw=True)
    node.create_service(Trigger, "do", lambda request: request[1:], raw=True)
    node.create_service(Trigger, "do", answer_bytes)  # type: ignore[arg-type]
    node.create_service(Trigger, "do", answer_later, raw=True)  # type: ignore[call-overload]
    typed: actors.Client[Trigger.Request, Trigger.Response] = node.create_client(Trigger, "do")
    raw: actors.Client[bytes, bytes] = node.create_client(Trigger, "do", raw=True)
    typed.call_async(b"")  # type: ignore[arg-type]
    raw.call_async(Trigger.Request())  # type: ignore[arg-type]
    return node.create_subscription(LaserScan, "scan", lambda scan: scans.extend([scan]))
