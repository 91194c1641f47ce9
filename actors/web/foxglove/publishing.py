"""What one client publishes: a publisher for each of its channels."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from actors.interfaces import cdr
from actors.interfaces.definition_texts import ROS2MSG, class_of_definition, full_type_name
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import type_hash, type_name
from actors.web.calls import RequestError, message_of, publishing_profile
from actors.web.foxglove.catalogue import Declared
from actors.web.json_decoding import decode_json
from actors.web.probes import broker_answers
from proto.errors import CallboardError

if TYPE_CHECKING:
    from actors.endpoints.publisher.publisher import Publisher
    from actors.interfaces.message import Message
    from actors.web.foxglove.graph import FoxgloveGraph
    from actors.web.foxglove.messages import ClientChannel
    from actors.web.workspace import Workspace


class PublishingError(CallboardError):
    """The broker refuses a client's publisher; the text says why."""


class _Open(NamedTuple):
    """A channel.

    Attributes:
        publisher: Publishes its messages.
        encoding: "cdr" or "json".
        ends: Ends it.
    """

    publisher: Publisher[Any]
    encoding: str
    ends: ExitStack


class Publishing:
    """The channels on which one client publishes.

    Args:
        workspace: Of its user.
        graph: Shows what it publishes to the user's clients.
    """

    def __init__(self, workspace: Workspace, graph: FoxgloveGraph) -> None:
        self._workspace, self._graph = workspace, graph
        self._open: dict[int, _Open] = {}

    async def open(self, channel: ClientChannel) -> None:
        """Make the publisher of a channel.

        Args:
            channel: Not open.

        Raises:
            CallboardError: Its type is not known, its topic is no name, or the broker refuses it.
        """
        workspace, observer = self._workspace, self._workspace.observer
        snapshot = await observer.newest_around(channel.topic)
        wanted = full_type_name(channel.schema_name)
        try:
            cls = await workspace.types.message(snapshot, channel.topic, wanted)
        except UnknownInterfaceError:
            if not channel.schema or channel.schema_encoding != ROS2MSG:
                raise
            cls = await workspace.work.run(class_of_definition, wanted, channel.schema, ROS2MSG)
        profile = publishing_profile(snapshot, channel.topic)
        publisher = observer.node.create_publisher(cls, channel.topic, profile)
        with ExitStack() as ends:
            ends.callback(publisher.destroy)
            await broker_answers(observer.node)  # in order: it has answered the publisher before
            if publisher.refusal:
                raise PublishingError(publisher.refusal)
            declared = Declared(publisher.topic_name, type_name(cls), type_hash(cls))
            ends.enter_context(self._graph.published(declared))
            self._open[channel.id] = _Open(publisher, channel.encoding, ends.pop_all())

    async def publish(self, channel: ClientChannel, payload: bytes) -> None:
        """Publish a message; nothing if its channel could not be opened.

        Args:
            channel: Its channel.
            payload: It in the channel's encoding.

        Raises:
            CallboardError: It is no message of the type, or the broker takes no more.
        """
        found = self._open.get(channel.id)
        if found is not None:
            cls: type[Message] = found.publisher.msg_type
            found.publisher.publish(await self._workspace.work.run(decode, cls, found.encoding, payload))

    def close(self, channel_id: int) -> None:
        """End the publisher of a channel; nothing if it could not be opened."""
        found = self._open.pop(channel_id, None)
        if found is not None:
            found.ends.close()

    def close_all(self) -> None:
        """End all publishers."""
        for each in [*self._open]:
            self.close(each)


def decode(cls: type[Message], encoding: str, payload: bytes) -> Message:
    """Return the message in some bytes of a client.

    Args:
        cls: Its class.
        encoding: "cdr" or "json".
        payload: The bytes. Fields that JSON leaves out have their defaults.

    Raises:
        InvalidMessageError, RequestError: It is no message of this class.
    """
    if encoding == "cdr":
        return cdr.codec_for(cls).decode(payload)
    try:
        return message_of(cls, decode_json(payload, dict[str, Any]))
    except msgspec.DecodeError as error:
        raise RequestError(f"This is no JSON object: {error}") from None
