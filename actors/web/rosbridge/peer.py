"""What the parts of a session share: the client, and the node in whose name it acts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.codec import codec_for
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import Action, Service
from actors.interfaces.registry import find_interface
from actors.web.calls import message_of
from actors.web.probes import broker_answers
from actors.web.rosbridge.frames import operation
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.outbox import Reply
from actors.web.rosbridge.values import SMALL_BYTES, json_of, values_from_json

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.endpoints.endpoint import Handle
    from actors.interfaces.message import Message
    from actors.node.bare_node import BareNode
    from actors.web.rosbridge.operations import CallService, Id, Level, SendActionGoal
    from actors.web.rosbridge.outbox import Outbox
    from actors.web.workspace import Workspace

NODE_NAME: Final = "rosbridge_websocket"
"""As rosbridge_suite's: tools leave nodes of this name out of what they draw. All clients share it."""

_LEVELS: Final[tuple[Level, ...]] = ("info", "warning", "error", "none")


class Peer:
    """A client, and its node.

    Args:
        workspace: Of the user.
        outbox: Sends to the client.

    Attributes:
        workspace: As given.
        level: The least serious status messages that the client wants.
    """

    def __init__(self, workspace: Workspace, outbox: Outbox) -> None:
        self.workspace = workspace
        self.level: Level = "error"
        self._outbox = outbox
        self._node: BareNode | None = None

    @property
    def node(self) -> BareNode:
        """The node that has the client's publishers, clients and servers; made when it is needed."""
        if self._node is None:
            self._node = self.workspace.observer.node.create_bare_node(NODE_NAME, shared_name=True)
        return self._node

    async def require_accepted(self, handle: Handle[Any]) -> None:
        """Wait until the broker has answered an endpoint of `node`, or cannot be reached.

        Args:
            handle: The endpoint, which has just been made.

        Raises:
            OperationError: The broker refuses it; it is destroyed.
        """
        await broker_answers(self.workspace.observer.node)  # in order: it has answered the endpoint before
        if refusal := handle.refusal:
            handle.destroy()
            raise OperationError(refusal)

    async def type_to_serve(self, kind: type[Service | Action], name: str, wanted: str) -> type[Any]:
        """Return the class of a service or an action that the client wants to serve.

        Args:
            kind: `Service` or `Action`.
            name: The full name of the service or action, whose type the graph may know.
            wanted: The full name of the type.

        Raises:
            UnknownInterfaceError: There is no such type, or it is of another kind.
            CallboardError: There is no broker now.
        """
        types = self.workspace.types
        snapshot = await self.workspace.observer.newest_around(name)
        try:
            return await (types.service if kind is Service else types.action)(snapshot, name, wanted)
        except UnknownInterfaceError:
            found = find_interface(wanted)
        if not issubclass(found, kind):
            raise UnknownInterfaceError(f"{wanted} is no {kind.__name__.lower()}")
        return found

    def close(self) -> None:
        """Destroy the node, and everything that it has."""
        if self._node is not None:
            self._node.destroy()

    def send(
        self,
        name: str,
        id_: Id,
        encoded: Mapping[str, bytes] | None = None,
        *,
        like: CallService | SendActionGoal | None = None,
        **fields: Any,
    ) -> None:
        """Send an operation.

        Args:
            name: Its name.
            id_: Its id.
            encoded: Fields whose values are JSON already.
            like: The request that it answers, which may ask for fragments and compression.
            **fields: Its other fields.
        """
        frame = operation(name, id_, encoded, **fields)
        self._outbox.add(Reply(frame) if like is None else Reply(frame, like.fragment_size, like.compression))

    async def send_later(self, name: str, id_: Id, encoded: Mapping[str, bytes], **options: Any) -> None:
        """Send an operation as soon as the client has read most of what waits: of a stream, not of replies.

        Args:
            name: As for `send`.
            id_: As for `send`.
            encoded: As for `send`.
            **options: As for `send`.
        """
        await self._outbox.room()
        self.send(name, id_, encoded, **options)

    def status(self, level: Level, text: str, id_: Id = None) -> None:
        """Send a status message, if the client wants those of its level.

        Args:
            level: How serious it is.
            text: One line.
            id_: Of the operation that it is about.
        """
        if _LEVELS.index(level) >= _LEVELS.index(self.level):
            self.send("status", id_, level=level, msg=text)

    async def message(self, msg_type: type[Message], values: Mapping[str, Any], size: int) -> Any:
        """Return a message with values that the client has sent.

        Args:
            msg_type: Its class.
            values: As the client has sent them.
            size: The bytes of the frame that had them: those of a large one are converted in a thread.

        Raises:
            CallboardError: They do not fit.
        """
        if size <= SMALL_BYTES:
            return _message(msg_type, values)
        return await self.workspace.work.run(_message, msg_type, values)

    async def encoded(self, msg_type: type[Message], values: Mapping[str, Any], size: int) -> bytes:
        """Return the same message in callboard's encoding.

        Args:
            msg_type: As for `message`.
            values: As for `message`.
            size: As for `message`.

        Raises:
            CallboardError: They do not fit.
        """
        if size <= SMALL_BYTES:
            return _encoded(msg_type, values)
        return await self.workspace.work.run(_encoded, msg_type, values)

    async def values(self, message: Message) -> bytes:
        """Return a message as JSON, in a thread: it may be of any size.

        Args:
            message: The message.
        """
        return await self.workspace.work.run(json_of, message, SMALL_BYTES + 1)

    async def json(self, msg_type: type[Message], data: bytes) -> bytes:
        """Return a message that was received as JSON.

        Args:
            msg_type: Its class.
            data: In callboard's encoding.

        Raises:
            InvalidMessageError: It cannot be decoded.
        """
        if len(data) <= SMALL_BYTES:
            return _json(msg_type, data)
        return await self.workspace.work.run(_json, msg_type, data)


def _message(msg_type: type[Message], values: Mapping[str, Any]) -> Any:
    return message_of(msg_type, values_from_json(msg_type, values))


def _encoded(msg_type: type[Message], values: Mapping[str, Any]) -> bytes:
    return codec_for(msg_type).encode(_message(msg_type, values))


def _json(msg_type: type[Message], data: bytes) -> bytes:
    return json_of(codec_for(msg_type).decode(data), len(data))


def full_name(name: str) -> str:
    """Return the full name of a topic, service or action.

    Args:
        name: As the client calls it; a relative one is below the root.
    """
    return name if name.startswith("/") else f"/{name}"


def full_type(name: str, kind: str) -> str:
    """Return the full name of a type.

    Args:
        name: As the client calls it: "std_msgs/String" is "std_msgs/msg/String".
        kind: "msg", "srv" or "action".
    """
    package, _, rest = name.strip("/").partition("/")
    return f"{package}/{kind}/{rest}" if rest and "/" not in rest else f"{package}/{rest}"


def require_room(used: int, most: int, what: str) -> None:
    """Raise OperationError if a client has as many of something as it may have.

    Args:
        used: How many it has.
        most: How many it may have.
        what: Their name in the plural.
    """
    if used >= most:
        raise OperationError(f"A client may have {most} {what}")
