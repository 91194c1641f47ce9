"""One Foxglove client: its WebSocket between its session and the graph."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from aiohttp import WSMsgType

from actors.errors import ServiceUnavailable
from actors.interfaces import cdr
from actors.interfaces.codec import codec_for
from actors.interfaces.convert import message_to_ordereddict
from actors.web.foxglove import messages as wire
from actors.web.foxglove.assets import AssetError, read_asset
from actors.web.foxglove.clock import CLOCK_TOPIC
from actors.web.foxglove.graph import FoxgloveGraph
from actors.web.foxglove.publishing import Publishing, decode
from actors.web.foxglove.session import (
    Call,
    ClosePublisher,
    CloseSubscription,
    Due,
    OpenPublisher,
    OpenSubscription,
    Publish,
    Session,
)
from actors.web.json_encoding import encode_json
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping

    from aiohttp.web import WebSocketResponse

    from actors.interfaces.message import Message
    from actors.web.foxglove.session import Command
    from actors.web.topic_feed import Received, TopicListener
    from actors.web.workspace import Workspace

TURN_SEC: Final = 0.005
"""Seconds for which messages are encoded and sent until others have a turn."""

LOOP_BYTES: Final = 64 * 1024
"""A larger message is encoded in the thread for long work."""

MAX_REQUESTS: Final = 80
"""Calls and requests for parameters that are under way; then nothing more is read from the client."""

DROPS_SEC: Final = 2.0
"""Seconds between two reports of dropped messages."""


class Arrived(NamedTuple):
    """A message for a client.

    Attributes:
        received: The message.
        time_ns: When it arrived, by the graph's clock once that has told the time.
    """

    received: Received
    time_ns: int


class FoxgloveClient:
    """A client as long as it is connected.

    Args:
        socket: Its prepared WebSocket.
        workspace: The sources of its user.
        session_id: The server's.
        control_refusal: Why it may only read; "" if it may control.
        count_drops: Called with numbers of messages that were dropped because it is slow.
    """

    def __init__(
        self,
        socket: WebSocketResponse,
        workspace: Workspace,
        *,
        session_id: str,
        control_refusal: str,
        count_drops: Callable[[int], object],
    ) -> None:
        self._socket, self._workspace = socket, workspace
        self._graph = workspace.shared(FoxgloveGraph)
        self._count_drops = count_drops
        self._session: Session[Arrived] = Session(
            f"callboard {workspace.observer.target}", session_id, control_refusal
        )
        self._listeners: dict[int, TopicListener] = {}
        self._news = asyncio.Event()
        self._has_room = asyncio.Event()
        self._publishing = Publishing(workspace, self._graph)
        self._tasks: set[asyncio.Task[None]] = set()
        self._requests = asyncio.Semaphore(MAX_REQUESTS)
        self._files: asyncio.Queue[wire.FetchAsset] = asyncio.Queue()
        """As many as the session allows."""
        self._problems: dict[str, str] = {}
        """Reported ones, by the id of their status."""

    async def run(self) -> None:
        """Serve the client until it leaves."""
        try:
            with self._graph.client(self):
                async with asyncio.TaskGroup() as group:
                    self._start = group.create_task
                    for work in (self._send(), self._fetch(), self._report_drops()):
                        self._begin(work)
                    await self._receive()
                    for task in self._tasks:
                        task.cancel()
        except* ConnectionError:
            pass  # the client has gone
        finally:
            for listener in self._listeners.values():
                listener.close()
            self._publishing.close_all()
            self._count_drops(self._session.report_drops())

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        task = self._start(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # What the graph tells

    def graph_changed(self) -> None:
        """GraphClient: channels, services or connections have changed."""
        graph, session = self._graph, self._session
        for command in session.set_channels(graph.catalogue.channels.present):
            self._unsubscribe(command)
        session.set_services(graph.catalogue.services.present)
        session.set_graph(graph.connections)
        session.set_clock(present=graph.clock.time_ns is not None)  # of which a new client knows nothing
        problems = {**graph.catalogue.channels.problems, **graph.catalogue.services.problems}
        if refusal := graph.clock.refusal:
            problems["clock"] = f"Times are those of this computer, not of '{CLOCK_TOPIC}': {refusal}"
        self._report_problems(problems)
        self._news.set()

    def clock_changed(self) -> None:
        """GraphClient: the clock has begun, ended, or moved."""
        clock = self._graph.clock
        self._session.set_clock(present=clock.time_ns is not None)
        if clock.time_ns is not None:
            self._session.set_time(clock.time_ns)
        self._news.set()

    def parameter_changed(self, name: str, value: Mapping[str, Any]) -> None:
        """GraphClient: a parameter has another value."""
        self._session.set_parameter(name, value)
        self._news.set()

    def _report_problems(self, problems: dict[str, str]) -> None:
        """Report why names of the graph are left out, and take back what is no longer so."""
        for name, text in problems.items():
            if self._problems.get(name) != text:
                self._session.answers.report(wire.WARNING, text, f"callboard.name:{name}")
        for name in self._problems.keys() - problems.keys():
            self._session.answers.take_back(f"callboard.name:{name}")
        self._problems = problems

    # From the client

    async def _receive(self) -> None:
        async for message in self._socket:
            if message.type not in {WSMsgType.TEXT, WSMsgType.BINARY}:
                break
            for command in self._session.receive(message.data):
                await self._carry_out(command)
            self._news.set()
            await self._wait_for_room()

    async def _wait_for_room(self) -> None:
        """Wait while the client does not read the answers that there are for it."""
        while self._session.answers.are_many:
            self._has_room.clear()
            await self._has_room.wait()

    async def _carry_out(self, command: Command) -> None:
        match command:
            case OpenSubscription():
                self._subscribe(command)
            case CloseSubscription():
                self._unsubscribe(command)
            case OpenPublisher():
                await self._try(f"'{command.channel.topic}'", self._publishing.open(command.channel))
            case Publish(channel, payload):
                await self._try(f"'{channel.topic}'", self._publishing.publish(channel, payload))
            case ClosePublisher(channel_id):
                self._publishing.close(channel_id)
            case wire.FetchAsset():
                self._files.put_nowait(command)
            case wire.SubscribeParameterUpdates():
                await self._try("Parameters", self._graph.parameters.watch())
            case Call() | wire.GetParameters() | wire.SetParameters():
                await self._requests.acquire()
                self._begin(self._request(command))

    async def _try(self, what: str, work: Coroutine[Any, Any, None]) -> None:
        """Do something for the client, and report why it fails."""
        try:
            await work
        except CallboardError as error:
            self._session.answers.report(wire.ERROR, f"{what}: {error}")

    async def _request(self, command: Call | wire.GetParameters | wire.SetParameters) -> None:
        try:
            if isinstance(command, Call):
                await self._call(command)
            else:
                await self._answer_parameters(command)
        finally:
            self._requests.release()
            self._news.set()

    async def _call(self, command: Call) -> None:
        service, request = command
        work, is_cdr = self._workspace.work, request.encoding == "cdr"
        try:
            cls = self._graph.catalogue.services.classes.get(service.id)
            if cls is None:
                raise ServiceUnavailable(f"Service '{service.name}' has gone")
            message = await work.run(decode, cls.Request, request.encoding, request.payload)
            response = await self._workspace.calls.request(cls, service.name, message)
            payload = await work.run(cdr.encode if is_cdr else _json, response)
        except CallboardError as error:
            failure = wire.service_call_failure(request.service_id, request.call_id, str(error))
            self._session.finish_call(failure, is_text=True)
        else:
            self._session.finish_call(wire.service_call_response(request, payload), is_text=False)

    async def _answer_parameters(self, command: wire.GetParameters | wire.SetParameters) -> None:
        problems: list[str] = []
        parameters, answers = self._graph.parameters, self._session.answers
        if isinstance(command, wire.SetParameters):
            await parameters.set(command.parameters, problems)
            names = [each.name for each in command.parameters]
            if command.id is not None:
                found = await parameters.get(names, problems) if names else []
                answers.add(wire.parameter_values(found, command.id))
        else:
            found = await parameters.get(command.parameter_names, problems)
            answers.add(wire.parameter_values(found, command.id))
        for each in problems:
            answers.report(wire.ERROR, each)

    async def _fetch(self) -> None:
        """Read the files that the client wants, one after the other."""
        while True:
            wanted = await self._files.get()
            try:
                found = wire.asset(wanted.request_id, await asyncio.to_thread(read_asset, wanted.uri))
            except AssetError as error:
                found = wire.asset_failure(wanted.request_id, str(error))
            self._session.finish_fetch(found)
            self._news.set()
            await self._wait_for_room()

    def _subscribe(self, command: OpenSubscription) -> None:
        number, channel = command

        def refused() -> None:
            listener = self._listeners.get(number)
            if listener is not None and listener.refusal:
                self._session.answers.report(wire.ERROR, f"'{channel.topic}': {listener.refusal}")
                self._news.set()

        receive = partial(self._add, number)
        try:
            self._listeners[number] = self._workspace.feeds.listen(
                channel.topic, receive, refused, channel.schema_name
            )
        except CallboardError as error:
            self._session.answers.report(wire.ERROR, f"'{channel.topic}': {error}")

    def _unsubscribe(self, command: CloseSubscription) -> None:
        listener = self._listeners.pop(command.subscription_id, None)
        if listener is not None:
            listener.close()

    def _add(self, number: int, received: Received, source: bytes) -> None:
        time_ns = self._graph.clock.time_ns
        if time_ns is None:
            time_ns = received.info.received_timestamp
        self._session.add_message(number, Arrived(received, time_ns), len(received.data), source)
        self._news.set()

    # To the client

    async def _send(self) -> None:
        """Send what there is, and wait while the client is slow."""
        turn_end = 0.0
        while True:
            await self._news.wait()
            self._news.clear()
            while (item := self._session.next()) is not None:
                if time.monotonic() > turn_end:
                    await asyncio.sleep(0)
                    turn_end = time.monotonic() + TURN_SEC
                if isinstance(item, Due):
                    await self._send_message(item)
                else:
                    kind = WSMsgType.TEXT if item.is_text else WSMsgType.BINARY
                    await self._socket.send_frame(item.data, kind)
                    self._has_room.set()

    async def _send_message(self, due: Due[Arrived]) -> None:
        received, time_ns = due.message
        cls = self._graph.catalogue.channels.classes.get(due.channel.id)
        if cls is None:
            return  # the channel has just gone, and been forgotten
        payload = received.forms.get(cls)
        if payload is None:
            try:
                if len(received.data) > LOOP_BYTES:
                    payload = await self._workspace.work.run(_cdr, cls, received.data)
                else:
                    payload = _cdr(cls, received.data)
            except CallboardError as error:  # it is not one of its type, or the thread has too much work
                self._count_drops(1)
                text = f"A message of '{due.channel.topic}' is left out: {error}"
                self._session.answers.report(wire.WARNING, text, f"callboard.message:{due.channel.topic}")
                return
            received.forms[cls] = payload
        data = wire.message_data(due.subscription_id, time_ns, payload)
        await self._socket.send_frame(data, WSMsgType.BINARY)

    async def _report_drops(self) -> None:
        while True:
            await asyncio.sleep(DROPS_SEC)
            if count := self._session.report_drops():
                self._count_drops(count)
                self._news.set()


def _cdr(cls: type[Message], data: bytes) -> bytes:
    """Return a message as CDR.

    Raises:
        InvalidMessageError: It is not one of this class, or has a value that CDR cannot have.
    """
    return cdr.codec_for(cls).encode(codec_for(cls).decode(data))


def _json(message: Message) -> bytes:
    """Return a message as JSON; NaN and infinities become null."""
    return encode_json(message_to_ordereddict(message))
