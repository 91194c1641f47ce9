"""A client of Foxglove's protocol that a test looks through."""

from __future__ import annotations

import asyncio
import itertools
import json
from typing import TYPE_CHECKING, Any, NamedTuple

import aiohttp

from actors.interfaces import cdr
from tests.actors.meeting import DEADLINE_SEC

if TYPE_CHECKING:
    from collections.abc import Callable

SDK = "foxglove.sdk.v1"


class Data(NamedTuple):
    """A message as it arrived."""

    subscription_id: int
    time_ns: int
    payload: bytes


class Peer:
    """A connected client, with everything that it has been sent.

    Args:
        socket: Its WebSocket.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self.statuses: list[str] = []
        self._numbers = itertools.count()

    async def send(self, op: str, **fields: Any) -> None:
        """Send a text."""
        await self.socket.send_str(json.dumps({"op": op, **fields}))

    async def next(self) -> dict[str, Any] | bytes:
        """Return the next message, and note what it announces."""
        async with asyncio.timeout(DEADLINE_SEC):
            message = await self.socket.receive()
        if message.type is aiohttp.WSMsgType.BINARY:
            data: bytes = message.data
            return data
        assert message.type is aiohttp.WSMsgType.TEXT, message
        found: dict[str, Any] = json.loads(message.data)
        match found["op"]:
            case "advertise":
                self.channels |= {each["topic"]: each for each in found["channels"]}
            case "unadvertise":
                gone = found["channelIds"]
                self.channels = {name: each for name, each in self.channels.items() if each["id"] not in gone}
            case "advertiseServices":
                self.services |= {each["name"]: each for each in found["services"]}
            case "status":
                self.statuses.append(found["message"])
        return found

    async def until(self, holds: Callable[[], object]) -> None:
        """Receive until something holds."""
        while not holds():
            await self.next()

    async def text(self, op: str) -> dict[str, Any]:
        """Return the next text of an operation."""
        while True:
            found = await self.next()
            if isinstance(found, dict) and found["op"] == op:
                return found

    async def binary(self, kind: int) -> bytes:
        """Return the next bytes that begin with this byte."""
        while True:
            found = await self.next()
            if isinstance(found, bytes) and found[0] == kind:
                return found

    async def data(self) -> Data:
        """Return the next message."""
        found = await self.binary(1)
        return Data(int.from_bytes(found[1:5], "little"), int.from_bytes(found[5:13], "little"), found[13:])

    async def message(self, cls: Any) -> Any:
        """Return the next message as one of a class."""
        return cdr.decode(cls, (await self.data()).payload)

    async def subscribe(self, topic: str) -> int:
        """Subscribe to a topic when it is there; return the number of the subscription."""
        await self.until(lambda: topic in self.channels)
        number = next(self._numbers)
        channel = self.channels[topic]["id"]
        await self.send("subscribe", subscriptions=[{"id": number, "channelId": channel}])
        return number

    async def call(self, service: str, encoding: str, payload: bytes) -> dict[str, Any] | bytes:
        """Call a service when it is there; return the payload, or the failure."""
        await self.until(lambda: service in self.services)
        number, name = self.services[service]["id"], encoding.encode()
        head = b"\x02" + number.to_bytes(4, "little") + (5).to_bytes(4, "little")
        await self.socket.send_bytes(head + len(name).to_bytes(4, "little") + name + payload)
        while True:
            found = await self.next()
            if isinstance(found, dict) and found["op"] == "serviceCallFailure":
                assert (found["serviceId"], found["callId"]) == (number, 5)
                return found
            if isinstance(found, bytes) and found[0] == 3:
                assert found[1:9] == head[1:]
                assert found[13 : 13 + len(name)] == name
                return found[13 + len(name) :]

    async def parameters(self, *names: str) -> dict[str, Any]:
        """Ask for parameters; return value and type by name."""
        await self.send("getParameters", parameterNames=names, id="ask")
        while True:
            found = await self.text("parameterValues")
            if found.get("id") == "ask":
                return values_in(found)


def values_in(found: dict[str, Any]) -> dict[str, Any]:
    """Return value and type by name of a text with parameters."""
    return {each["name"]: (each.get("value"), each.get("type")) for each in found["parameters"]}
