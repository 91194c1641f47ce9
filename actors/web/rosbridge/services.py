"""The services that one client calls, and those that it serves."""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from actors.errors import ServiceUnavailable
from actors.interfaces.message import Service, type_name
from actors.time.timeout import DEFAULT_TIMEOUT
from actors.web.calls import MATCH_SEC
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.peer import full_name, full_type, require_room
from actors.web.rosbridge.values import arguments_by_name
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.endpoints.client.client import Client
    from actors.endpoints.service.service import ServiceServer
    from actors.web.rosbridge.operations import (
        AdvertiseService,
        CallService,
        ServiceResponse,
        UnadvertiseService,
    )
    from actors.web.rosbridge.peer import Peer

MAX_CLIENTS: Final = 32
"""Services whose clients are kept for further calls; the one used least recently makes room."""

MAX_SERVICES: Final = 100
"""Services that a client serves."""

MAX_REQUESTS: Final = 1000
"""Requests that a client has got and not answered, of one service."""


class RequestFailedError(CallboardError):
    """A client of rosbridge has answered a request with `"result": false`; the text is its own."""


class CalledServices:
    """The services that one client calls.

    Args:
        peer: The client.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._clients: OrderedDict[tuple[str, str], Client[bytes, bytes]] = OrderedDict()
        self._calls: Counter[Client[bytes, bytes]] = Counter()
        """Calls that wait, by client, which is not destroyed meanwhile: several may be made for one key."""

    def has_server(self, request: CallService) -> bool:
        """Return whether a node of the graph serves a service."""
        name = full_name(request.service)
        return bool(self._peer.workspace.observer.around(name).count(EntryKind.SERVICE, name))

    async def call(self, request: CallService, size: int) -> bytes:
        """Call a service.

        Args:
            request: The call.
            size: The bytes of its frame.

        Returns:
            The response as JSON.

        Raises:
            CallboardError: There is no server, no response in time, or the request does not fit.
        """
        key = full_name(request.service), full_type(request.type, "srv") if request.type else ""
        client = self._clients.get(key) or await self._client(*key)
        self._clients[key] = client
        self._clients.move_to_end(key)
        self._calls[client] += 1
        try:
            kind: Any = client.srv_type
            values = arguments_by_name(kind.Request, request.args)
            encoded = await self._peer.encoded(kind.Request, values, size)
            response = await client.call(encoded, request.timeout or DEFAULT_TIMEOUT)
        except ServiceUnavailable:
            if self._clients.get(key) is client:
                del self._clients[key]  # the next server may have another type
            raise
        finally:
            self._calls[client] -= 1
            if not self._calls[client]:
                del self._calls[client]
                if self._clients.get(key) is not client:
                    client.destroy()
            self._make_room()
        return await self._peer.json(kind.Response, response)

    async def _client(self, name: str, wanted: str) -> Client[bytes, bytes]:
        workspace = self._peer.workspace
        snapshot = await workspace.observer.newest_around(name)
        if not snapshot.count(EntryKind.SERVICE, name):
            raise ServiceUnavailable(f"Service '{name}' has no server now")
        srv_type: Any = await workspace.types.service(snapshot, name, wanted)
        client = self._peer.node.create_client(srv_type, name, raw=True)
        if not await client.wait_for_service(MATCH_SEC):
            client.destroy()
            raise ServiceUnavailable(f"Service '{name}' has no server of this type now")
        return client

    def _make_room(self) -> None:
        unused = [key for key, client in self._clients.items() if client not in self._calls]
        for key in unused[: max(0, len(self._clients) - MAX_CLIENTS)]:
            self._clients.pop(key).destroy()


@dataclass(slots=True)
class _Served:
    """A service that the client serves.

    Attributes:
        server: The server.
        requests: Futures of the responses, by the ids that the client has got.
    """

    server: ServiceServer[bytes, bytes]
    requests: dict[str, asyncio.Future[bytes]] = field(default_factory=dict[str, "asyncio.Future[bytes]"])


class ServedServices:
    """The services that one client serves.

    Args:
        peer: The client.
    """

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._services: dict[str, _Served] = {}
        self._numbers = count(1)

    async def advertise(self, request: AdvertiseService) -> None:
        """Serve a service, or replace its server.

        Raises:
            CallboardError: The type is not known, the name is not valid, or there are too many.
        """
        name, wanted = full_name(request.service), full_type(request.type, "srv")
        srv_type: Any = await self._peer.type_to_serve(Service, name, wanted)
        old = self._services.pop(name, None)
        if old is not None:
            old.server.destroy()
        require_room(len(self._services), MAX_SERVICES, "services")

        async def serve(data: bytes) -> bytes:
            return await self._ask(request.service, srv_type, served, data)

        server = self._peer.node.create_service(srv_type, name, serve, concurrent=True, raw=True)
        served = self._services[name] = _Served(server)
        try:
            await self._peer.require_accepted(server)
        except OperationError:
            del self._services[name]
            raise

    def unadvertise(self, request: UnadvertiseService) -> None:
        """Serve a service no longer; calls that wait fail.

        Raises:
            OperationError: The client does not serve it.
        """
        served = self._services.pop(full_name(request.service), None)
        if served is None:
            raise OperationError(f"This client has not advertised the service '{request.service}'")
        served.server.destroy()

    async def respond(self, response: ServiceResponse, size: int) -> None:
        """Answer a request.

        Args:
            response: The answer.
            size: The bytes of its frame.

        Raises:
            CallboardError: There is no such request, or the values do not fit; then the call fails.
        """
        served = self._services.get(full_name(response.service))
        future = None if served is None else served.requests.get(str(response.id))
        if served is None or future is None or future.done():
            raise OperationError(f"There is no request of '{response.service}' with this id that waits")
        values = response.values
        # Many programs return false and a response: as rosbridge_suite, the values count.
        if isinstance(values, str) or (not values and not response.result):
            text = values if isinstance(values, str) and values else "The service has failed"
            future.set_exception(RequestFailedError(text))
            return
        kind: Any = served.server.srv_type
        try:
            by_name = arguments_by_name(kind.Response, values)
            encoded = await self._peer.encoded(kind.Response, by_name, size)
        except CallboardError as error:
            if not future.done():
                future.set_exception(RequestFailedError(str(error)))
            raise
        if not future.done():
            future.set_result(encoded)

    async def _ask(self, text: str, srv_type: Any, served: _Served, data: bytes) -> bytes:
        if len(served.requests) >= MAX_REQUESTS:
            raise RequestFailedError(f"{MAX_REQUESTS} requests wait for this client of rosbridge")
        id_ = f"service_request:{text}:{next(self._numbers)}"
        future: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        served.requests[id_] = future
        try:
            args = await self._peer.json(srv_type.Request, data)
            self._peer.send("call_service", id_, {"args": args}, service=text, type=type_name(srv_type))
            return await future
        finally:
            del served.requests[id_]
