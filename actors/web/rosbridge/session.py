"""One client of rosbridge: reads its operations and does what they say.

Operations are done in the order in which they arrive. Calls and goals begin in this order and go on beside
the following operations: a slow service holds up nothing else of the client.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from aiohttp import WSMsgType

from actors.web.rosbridge import operations as ops
from actors.web.rosbridge import rosapi
from actors.web.rosbridge.actions import ExecutedActions, SentGoals
from actors.web.rosbridge.fragments import Fragments
from actors.web.rosbridge.operations import OperationError, decode_operation
from actors.web.rosbridge.outbox import Outbox
from actors.web.rosbridge.peer import Peer, full_name
from actors.web.rosbridge.services import CalledServices, ServedServices
from actors.web.rosbridge.topics import PublishedTopics, ReadTopics
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine

    from aiohttp.web import WebSocketResponse

    from actors.web.workspace import Workspace

MAX_FRAME_BYTES: Final = 10 * 1024 * 1024
"""Largest frame from a client, as of rosbridge_suite: a larger one ends the connection with 1009."""

MAX_TASKS: Final = 256
"""Calls and goals of one client that wait for their ends."""

OPERATIONS_PER_TURN: Final = 16
"""Operations of one client that are done in one loop turn."""

_Work: TypeAlias = "Coroutine[Any, Any, None]"
_Handler: TypeAlias = "Callable[[Any, int], Awaitable[None] | None]"


class RosbridgeSession:
    """A client's session.

    Args:
        socket: The prepared WebSocket.
        workspace: Of the user.
        control_refusal: Why the client may not control anything; "" if it may.
        disconnect: Ends the connection at once, because too much waits for the client.
        count_drops: Called with how many messages the client did not get because it is too slow.
    """

    def __init__(
        self,
        socket: WebSocketResponse,
        workspace: Workspace,
        *,
        control_refusal: str,
        disconnect: Callable[[], object],
        count_drops: Callable[[int], object],
    ) -> None:
        self._socket, self._workspace, self._refusal = socket, workspace, control_refusal
        self._outbox = Outbox(socket, workspace.work, disconnect)
        self._peer = Peer(workspace, self._outbox)
        self._read = ReadTopics(self._peer, self._outbox, count_drops)
        self._published = PublishedTopics(self._peer)
        self._called = CalledServices(self._peer)
        self._served = ServedServices(self._peer)
        self._goals = SentGoals(self._peer)
        self._executed = ExecutedActions(self._peer)
        self._fragments = Fragments()
        self._tasks: set[asyncio.Task[None]] = set()
        self._do = self._handlers()

    async def run(self) -> None:
        """Serve the client until it leaves."""
        try:
            async with asyncio.TaskGroup() as group:
                self._group = group
                sending = group.create_task(self._outbox.run(self._read.send))
                await self._receive()
                sending.cancel()
                for task in tuple(self._tasks):
                    task.cancel()
        except* ConnectionError:
            pass  # the client has gone
        finally:
            self._read.close()
            self._peer.close()

    async def _receive(self) -> None:
        done = 0
        async for frame in self._socket:
            if frame.type not in {WSMsgType.TEXT, WSMsgType.BINARY}:
                break
            await self._handle(frame.data)
            await self._outbox.room()
            done += 1
            if done % OPERATIONS_PER_TURN == 0:
                await asyncio.sleep(0)  # frames that have arrived are read without waiting

    async def _handle(self, data: str | bytes) -> None:
        """Do what an operation in JSON says; report why it cannot be done."""
        operation: ops.AnyOperation | None = None
        try:
            operation = decode_operation(data)
            if isinstance(operation, ops.Fragment):
                whole = self._fragments.add(operation, asyncio.get_running_loop().time())
                if whole is None:
                    return
                data, operation = whole, decode_operation(whole)
            if self._refusal and operation.controls and not _asks_rosapi(operation):
                raise OperationError(self._refusal)
            done = self._do[type(operation)](operation, len(data))
            if done is not None:
                await done
        except OperationError as error:
            name = "" if operation is None else f"{_name_of(operation)}: "
            id_ = error.id if operation is None else operation.id
            self._fail(operation, f"{name}{error}", id_)
        except CallboardError as error:
            assert operation is not None
            self._fail(operation, f"{_name_of(operation)}: {error}", operation.id)

    def _fail(self, operation: ops.AnyOperation | None, text: str, id_: ops.Id) -> None:
        if isinstance(operation, ops.CallService):  # its client waits for a response, not for a status
            self._refuse(operation, text)
        elif isinstance(operation, ops.SendActionGoal):
            fields: dict[str, Any] = {
                "action": operation.action,
                "values": text,
                "status": 0,
                "result": False,
            }
            self._peer.send("action_result", operation.id, like=operation, **fields)
        else:
            self._peer.status("error", text, id_)

    def _handlers(self) -> dict[type[ops.Operation], _Handler]:
        """Return what each operation does; it takes the operation and the bytes of its frame."""
        read, published, served, executed = self._read, self._published, self._served, self._executed
        return {
            ops.Subscribe: _without_size(read.subscribe),
            ops.Unsubscribe: _without_size(read.unsubscribe),
            ops.Advertise: _without_size(published.advertise),
            ops.Unadvertise: _without_size(published.unadvertise),
            ops.Publish: published.publish,
            ops.CallService: self._begin_with(self._call),
            ops.AdvertiseService: _without_size(served.advertise),
            ops.UnadvertiseService: _without_size(served.unadvertise),
            ops.ServiceResponse: served.respond,
            ops.SendActionGoal: self._begin_with(self._send_goal),
            ops.CancelActionGoal: self._begin_with(self._cancel_goal),
            ops.AdvertiseAction: _without_size(executed.advertise),
            ops.UnadvertiseAction: _without_size(executed.unadvertise),
            ops.ActionFeedback: executed.publish_feedback,
            ops.ActionResult: executed.finish,
            ops.SetLevel: _without_size(self._set_level),
            ops.Fragment: _without_size(self._refuse_fragment),
            ops.Authenticate: _without_size(lambda _: None),
        }

    def _set_level(self, request: ops.SetLevel) -> None:
        self._peer.level = request.level

    def _refuse_fragment(self, _: ops.Fragment) -> None:
        raise OperationError("A fragment cannot be in fragments")

    def _begin_with(self, work: Callable[[Any, int], _Work]) -> _Handler:
        return lambda operation, size: self._begin(work(operation, size))

    def _begin(self, task: _Work) -> None:
        if len(self._tasks) >= MAX_TASKS:
            task.close()
            raise OperationError(f"{MAX_TASKS} calls and goals of this client wait already")
        begun = self._group.create_task(task)
        self._tasks.add(begun)
        begun.add_done_callback(self._tasks.discard)

    async def _call(self, request: ops.CallService, size: int) -> None:
        try:
            values = await self._answer(request, size)
        except CallboardError as error:
            self._refuse(request, str(error))
        else:
            fields: dict[str, Any] = {"service": request.service, "result": True}
            self._peer.send("service_response", request.id, {"values": values}, like=request, **fields)

    async def _answer(self, request: ops.CallService, size: int) -> bytes:
        service = rosapi.service_of_rosapi(full_name(request.service))
        # Who may not control anything calls no service of the graph, whatever its name is.
        if service and (self._refusal or not self._called.has_server(request)):
            return await rosapi.answer(self._workspace, service, request.args)
        return await self._called.call(request, size)

    async def _send_goal(self, request: ops.SendActionGoal, size: int) -> None:
        try:
            await self._goals.send(request, size)
        except CallboardError as error:
            self._fail(request, str(error), request.id)

    async def _cancel_goal(self, request: ops.CancelActionGoal, _: int) -> None:
        try:
            await self._goals.cancel(request)
        except CallboardError as error:
            self._fail(request, f"cancel_action_goal: {error}", request.id)

    def _refuse(self, request: ops.CallService, text: str) -> None:
        fields: dict[str, Any] = {"service": request.service, "values": text, "result": False}
        self._peer.send("service_response", request.id, like=request, **fields)


def _without_size(work: Callable[[Any], Awaitable[None] | None]) -> _Handler:
    return lambda operation, _: work(operation)


def _asks_rosapi(operation: ops.AnyOperation) -> bool:
    if not isinstance(operation, ops.CallService):
        return False
    service = rosapi.service_of_rosapi(full_name(operation.service))
    return bool(service) and service not in rosapi.CONTROLS


def _name_of(operation: ops.AnyOperation) -> str:
    return str(operation.__struct_config__.tag)
