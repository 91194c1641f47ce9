"""Questions to a server of rosbridge, whose answers by rosbridge_suite are recorded: see `recorded.json`.

    ROSBRIDGE_CHECKOUT=checkouts/rosbridge_suite python -m tests.upstream.rosbridge_suite

records them again. A client hears what it publishes, and one calls what another serves.
"""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from aiohttp import WSMsgType

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    import aiohttp

REPEAT_SEC: Final = 0.05
"""Until a message is published again: at first its subscription may not be matched."""

STAMP: Final = {"sec": "now", "nanosec": "now"}
"""In place of a stamp that the server has set."""


class Echo(NamedTuple):
    """A message that a client publishes and hears.

    Attributes:
        kind: Its type.
        values: As they are sent.
    """

    kind: str
    values: dict[str, Any]


HEADER: Final = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}

ECHOES: Final[dict[str, Echo]] = {
    "text": Echo("std_msgs/String", {"data": "grüße"}),
    "full type name": Echo("std_msgs/msg/String", {"data": "a"}),
    "defaults": Echo("geometry_msgs/Twist", {}),
    "a part of the fields": Echo("geometry_msgs/Twist", {"linear": {"x": 1}}),
    "integers for floats": Echo("std_msgs/Float64", {"data": 3}),
    "the largest integer": Echo("std_msgs/Int64", {"data": 2**63 - 1}),
    "bytes in base64": Echo("std_msgs/UInt8MultiArray", {"data": "AQL/"}),
    "bytes in a list": Echo("std_msgs/UInt8MultiArray", {"data": [1, 2, 255]}),
    "a fixed array of bytes": Echo("unique_identifier_msgs/UUID", {"uuid": "AAECAwQFBgcICQoLDA0ODw=="}),
    "an array of int8": Echo("std_msgs/Int8MultiArray", {"data": [-1, 2]}),
    "an array of float32": Echo("std_msgs/Float32MultiArray", {"data": [0.5, 1]}),
    "a fixed array of float64": Echo("geometry_msgs/PoseWithCovariance", {"covariance": [0.5] * 36}),
    "an octet": Echo("std_msgs/Byte", {"data": 7}),
    "an array of octets": Echo("std_msgs/ByteMultiArray", {"data": [7]}),
    "a header": Echo("geometry_msgs/PointStamped", {"header": HEADER}),
    "times of ROS 1": Echo("geometry_msgs/PointStamped", {"header": {"stamp": {"secs": 1, "nsecs": 2}}}),
    "a header without a stamp": Echo("geometry_msgs/PointStamped", {"header": {"frame_id": "map"}}),
    "no header": Echo("geometry_msgs/PointStamped", {"point": {"x": 1.0}}),
    "a time": Echo("builtin_interfaces/Time", {"sec": 1, "nanosec": 2}),
    "messages in a list": Echo("geometry_msgs/Polygon", {"points": [{"x": 1.0}, {}]}),
    "null for a float": Echo("std_msgs/Float64", {"data": None}),
    "a wrong type": Echo("std_msgs/Int32", {"data": "x"}),
    "an unknown field": Echo("std_msgs/Int32", {"color": 1}),
}
"""By name. Without an answer, the server has refused the message."""

CALLS: Final[dict[str, dict[str, Any]]] = {
    "arguments by name": {
        "args": {"data": True},
        "values": {"success": True, "message": "done"},
        "result": True,
    },
    "arguments in order": {"args": [True], "values": {"success": True, "message": "done"}, "result": True},
    "no arguments": {"values": {"success": False, "message": ""}, "result": True},
    "a result of false": {"args": {}, "values": {"success": True, "message": "x"}, "result": False},
    "a part of the response": {"args": {}, "values": {"message": "x"}, "result": True},
}
"""Calls of a service that the client itself serves, with what it answers."""


class Client:
    """A client of any server of rosbridge.

    Args:
        socket: Its WebSocket.
        patience_sec: How long an answer may take.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse, patience_sec: float) -> None:
        self._socket, self._patience_sec = socket, patience_sec

    async def echo(self, number: int, echo: Echo) -> Any:
        """Return a message as it is heard; None if it is not."""
        topic = f"/echo_{number}"
        await self.send("subscribe", id="s", topic=topic, type=echo.kind)
        await self.send("advertise", id="a", topic=topic, type=echo.kind)
        found: dict[str, Any] = {}
        with suppress(TimeoutError):
            async with asyncio.timeout(self._patience_sec):
                while found.get("topic") != topic and found.get("op") != "status":
                    await self.send("publish", topic=topic, msg=echo.values)
                    found = await self.next(REPEAT_SEC)
        await self.send("unsubscribe", id="s", topic=topic)
        await self.send("unadvertise", id="a", topic=topic)
        return _normal(found["msg"]) if found.get("op") == "publish" else None

    async def send(self, op: str, **fields: Any) -> None:
        """Send an operation."""
        await self._socket.send_str(json.dumps({"op": op, **fields}))

    async def next(self, seconds: float) -> dict[str, Any]:
        """Return the next operation; an empty one if none comes in time."""
        try:
            message = await self._socket.receive(seconds)
        except TimeoutError:
            return {}
        assert message.type is WSMsgType.TEXT, message
        found: dict[str, Any] = json.loads(message.data)
        return found


async def called(
    server: Client, caller: Client, number: int, call: dict[str, Any], patience_sec: float
) -> Any:
    """Return the arguments that a client gets which serves a service, and the response that another gets."""
    service = f"/call_{number}"
    await server.send("advertise_service", service=service, type="std_srvs/SetBool")
    args = {"args": call["args"]} if "args" in call else {}
    async with asyncio.timeout(patience_sec):
        request: dict[str, Any] = {}
        while request.get("service") != service:  # at first the service may not be known
            await caller.send("call_service", id="c", service=service, **args)
            request = await server.next(REPEAT_SEC)
        answer = {key: call[key] for key in ("values", "result")}
        await server.send("service_response", id=request["id"], service=service, **answer)
        response: dict[str, Any] = {}
        while not response.get("result"):
            response = await caller.next(patience_sec)
    await server.send("unadvertise_service", service=service)
    return {"args": request["args"], "values": response["values"], "result": response["result"]}


async def answers(
    connect: Callable[[], Awaitable[aiohttp.ClientWebSocketResponse]], patience_sec: float
) -> dict[str, Any]:
    """Ask everything; return the answers by the names of the questions.

    Args:
        connect: Returns a WebSocket of the server.
        patience_sec: How long an answer may take.
    """
    first = Client(await connect(), patience_sec)
    found = {name: await first.echo(number, echo) for number, (name, echo) in enumerate(ECHOES.items())}
    for number, (name, call) in enumerate(CALLS.items()):
        # Clients of its own: in rosbridge_suite a call holds up everything else of its client.
        server, caller = Client(await connect(), patience_sec), Client(await connect(), patience_sec)
        found[name] = await called(server, caller, number, call, patience_sec)
    return found


def _normal(message: dict[str, Any]) -> dict[str, Any]:
    header: Any = message.get("header")
    if header is not None and header["stamp"]["sec"] > 10**6:
        header["stamp"] = STAMP
    return message
