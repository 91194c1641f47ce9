"""The messages of Foxglove's WebSocket protocol. Pure.

The specification is https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md; what foxglove-sdk calls
`foxglove.sdk.v1` differs in its name only. A text frame is a JSON object with its kind in `op`. A
binary frame begins with its kind in one byte; its integers are little-endian.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, TypeAlias

import msgspec

from actors.web.json_decoding import decode_json
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")

MAX_ITEMS: Final = 10_000
"""Items of a list in a message of a client."""

MAX_NAME_CHARACTERS: Final = 1024
"""Characters of a name or an id that a client has chosen."""

MAX_SCHEMA_CHARACTERS: Final = 256 * 1024

INFO, WARNING, ERROR = range(3)
"""Levels of a status."""

_U32: Final = struct.Struct("<I")
_MESSAGE: Final = struct.Struct("<BIQ")
_TIME: Final = struct.Struct("<BQ")
_CALL: Final = struct.Struct("<BIII")
_ASSET: Final = struct.Struct("<BIBI")

_MESSAGE_DATA, _SERVICE_CALL = 1, 2
"""The first byte of what a client sends."""

Id: TypeAlias = Annotated[int, msgspec.Meta(ge=0, lt=2**32)]
Name: TypeAlias = Annotated[str, msgspec.Meta(max_length=MAX_NAME_CHARACTERS)]
Ids: TypeAlias = Annotated[list[Id], msgspec.Meta(max_length=MAX_ITEMS)]
Names: TypeAlias = Annotated[list[Name], msgspec.Meta(max_length=MAX_ITEMS)]


class ProtocolError(CallboardError):
    """A message of a client that breaks the protocol; the text says how."""


class Item(msgspec.Struct, frozen=True, rename="camel"):
    """A part of a client's message."""


class ClientText(msgspec.Struct, frozen=True, rename="camel", tag_field="op"):
    """A text frame from a client."""


class Subscription(Item, frozen=True):
    """A subscription: its id, and that of the channel."""

    id: Id
    channel_id: Id


class Subscribe(ClientText, frozen=True, tag="subscribe"):
    """Send the messages of some channels."""

    subscriptions: Annotated[list[Subscription], msgspec.Meta(max_length=MAX_ITEMS)]


class Unsubscribe(ClientText, frozen=True, tag="unsubscribe"):
    """Send them no more."""

    subscription_ids: Ids


class ClientChannel(Item, frozen=True):
    """A channel on which a client publishes."""

    id: Id
    topic: Name
    encoding: Name
    schema_name: Name
    schema: Annotated[str, msgspec.Meta(max_length=MAX_SCHEMA_CHARACTERS)] | None = None
    schema_encoding: Name | None = None


class Advertise(ClientText, frozen=True, tag="advertise"):
    """The client will publish."""

    channels: Annotated[list[ClientChannel], msgspec.Meta(max_length=MAX_ITEMS)]


class Unadvertise(ClientText, frozen=True, tag="unadvertise"):
    """It will not any more."""

    channel_ids: Ids


class ParameterItem(Item, frozen=True):
    """A parameter with its value: UNSET for none."""

    name: Name
    value: Any = msgspec.UNSET
    type: Name | None = None


class GetParameters(ClientText, frozen=True, tag="getParameters"):
    """Send the values of parameters, of all if there are no names."""

    parameter_names: Names
    id: Name | None = None


class SetParameters(ClientText, frozen=True, tag="setParameters"):
    """Set parameters; send their values if there is an id."""

    parameters: Annotated[list[ParameterItem], msgspec.Meta(max_length=MAX_ITEMS)]
    id: Name | None = None


class SubscribeParameterUpdates(ClientText, frozen=True, tag="subscribeParameterUpdates"):
    """Send the values of parameters when they change, of all if there are no names."""

    parameter_names: Names


class UnsubscribeParameterUpdates(ClientText, frozen=True, tag="unsubscribeParameterUpdates"):
    """Send them no more, those of all if there are no names."""

    parameter_names: Names


class SubscribeConnectionGraph(ClientText, frozen=True, tag="subscribeConnectionGraph"):
    """Send who publishes, subscribes and serves, and each change."""


class UnsubscribeConnectionGraph(ClientText, frozen=True, tag="unsubscribeConnectionGraph"):
    """Send it no more."""


class FetchAsset(ClientText, frozen=True, tag="fetchAsset"):
    """Send a file."""

    uri: Annotated[str, msgspec.Meta(max_length=4096)]
    request_id: Id


class MessageData(NamedTuple):
    """A message of a client's channel."""

    channel_id: int
    payload: bytes


class ServiceCall(NamedTuple):
    """A call of a service."""

    service_id: int
    call_id: int
    encoding: str
    payload: bytes


TextMessage: TypeAlias = (
    Subscribe
    | Unsubscribe
    | Advertise
    | Unadvertise
    | GetParameters
    | SetParameters
    | SubscribeParameterUpdates
    | UnsubscribeParameterUpdates
    | SubscribeConnectionGraph
    | UnsubscribeConnectionGraph
    | FetchAsset
)
ClientMessage: TypeAlias = TextMessage | MessageData | ServiceCall


class Channel(NamedTuple):
    """A topic with one of its types, as clients see it.

    Attributes:
        id: Never used for another channel.
        topic: The full name.
        schema_name: The type's name.
        schema: Its definition, and those of all that it contains.
    """

    id: int
    topic: str
    schema_name: str
    schema: str


class Service(NamedTuple):
    """A service, as clients see it.

    Attributes:
        id: Never used for another service.
        name: The full name.
        type: The type's name.
        request_schema: The definition of the request.
        response_schema: That of the response.
    """

    id: int
    name: str
    type: str
    request_schema: str
    response_schema: str


def parse(message: str | bytes) -> ClientMessage:
    """Return what a client has sent.

    Raises:
        ProtocolError: It breaks the protocol.
    """
    if isinstance(message, str):
        try:
            return decode_json(message, TextMessage)  # type: ignore[arg-type]
        except msgspec.DecodeError as error:
            raise ProtocolError(f"Not a message of the protocol: {error}") from None
    kind = message[:1]
    try:
        if kind == bytes([_MESSAGE_DATA]):
            return MessageData(_U32.unpack_from(message, 1)[0], message[5:])
        if kind == bytes([_SERVICE_CALL]):
            _, service, call, length = _CALL.unpack_from(message)
            end = _CALL.size + length
            if end > len(message):
                raise ProtocolError("A call ends within the name of its encoding")
            encoding = message[_CALL.size : end].decode(errors="replace")[:MAX_NAME_CHARACTERS]
            return ServiceCall(service, call, encoding, message[end:])
    except struct.error:
        raise ProtocolError(f"A message of {len(message)} bytes is too short") from None
    raise ProtocolError(f"No message begins with the byte {message[0]}" if message else "A message is empty")


def server_info(name: str, capabilities: Sequence[str], encodings: Sequence[str], session_id: str) -> bytes:
    """Return the text that says what the server can do.

    Args:
        name: The server's.
        capabilities: Of the protocol, such as "clientPublish".
        encodings: In which clients may publish and call.
        session_id: Another one lets clients forget what they have received.
    """
    return _text(
        "serverInfo",
        name=name,
        capabilities=capabilities,
        supportedEncodings=encodings,
        metadata={},
        sessionId=session_id,
    )


def status(level: int, message: str, status_id: str = "") -> bytes:
    """Return a text for the user of the client.

    Args:
        level: INFO, WARNING or ERROR.
        message: The text.
        status_id: It replaces a former one with this id; "" for none.
    """
    return _text("status", level=level, message=message, **({"id": status_id} if status_id else {}))


def remove_status(status_ids: Sequence[str]) -> bytes:
    """Return the text that takes back others of the server."""
    return _text("removeStatus", statusIds=status_ids)


def advertise(channels: Sequence[Channel]) -> bytes:
    """Return the text that announces channels."""
    found = [
        {
            "id": each.id,
            "topic": each.topic,
            "encoding": "cdr",
            "schemaName": each.schema_name,
            "schema": each.schema,
            "schemaEncoding": "ros2msg",
        }
        for each in channels
    ]
    return _text("advertise", channels=found)


def unadvertise(channel_ids: Sequence[int]) -> bytes:
    """Return the text that takes channels back."""
    return _text("unadvertise", channelIds=channel_ids)


def advertise_services(services: Sequence[Service]) -> bytes:
    """Return the text that announces services."""
    found = [
        {
            "id": each.id,
            "name": each.name,
            "type": each.type,
            "request": _part(f"{each.type}_Request", each.request_schema),
            "response": _part(f"{each.type}_Response", each.response_schema),
        }
        for each in services
    ]
    return _text("advertiseServices", services=found)


def _part(name: str, schema: str) -> dict[str, str]:
    return {"encoding": "cdr", "schemaName": name, "schemaEncoding": "ros2msg", "schema": schema}


def unadvertise_services(service_ids: Sequence[int]) -> bytes:
    """Return the text that takes services back."""
    return _text("unadvertiseServices", serviceIds=service_ids)


def parameter_values(parameters: Sequence[Mapping[str, Any]], request_id: str | None = None) -> bytes:
    """Return the text with values of parameters.

    Args:
        parameters: Each has `name`, `value` unless it is not set, and `type` if the value does not say it.
        request_id: Of the request that this answers; None for a change.
    """
    return _text(
        "parameterValues", parameters=parameters, **({} if request_id is None else {"id": request_id})
    )


def connection_graph_update(
    published: Mapping[str, Sequence[str]],
    subscribed: Mapping[str, Sequence[str]],
    services: Mapping[str, Sequence[str]],
    removed_topics: Sequence[str],
    removed_services: Sequence[str],
) -> bytes:
    """Return the text with changes of the graph.

    Args:
        published: Publishers by topic, for topics where they have changed.
        subscribed: Subscriptions by topic, likewise.
        services: Servers by service, likewise.
        removed_topics: Topics that nobody has any more.
        removed_services: Services that nobody has any more.
    """
    return _text(
        "connectionGraphUpdate",
        publishedTopics=[{"name": name, "publisherIds": ids} for name, ids in published.items()],
        subscribedTopics=[{"name": name, "subscriberIds": ids} for name, ids in subscribed.items()],
        advertisedServices=[{"name": name, "providerIds": ids} for name, ids in services.items()],
        removedTopics=removed_topics,
        removedServices=removed_services,
    )


def service_call_failure(service_id: int, call_id: int, message: str) -> bytes:
    """Return the text that says why a call has failed."""
    return _text("serviceCallFailure", serviceId=service_id, callId=call_id, message=message)


def message_data(subscription_id: int, time_ns: int, payload: bytes) -> bytes:
    """Return the bytes of a message.

    Args:
        subscription_id: Of the client.
        time_ns: When it was received.
        payload: The message in the encoding of its channel.
    """
    return _MESSAGE.pack(1, subscription_id, time_ns) + payload


def time(time_ns: int) -> bytes:
    """Return the bytes that say what time it is."""
    return _TIME.pack(2, time_ns)


def service_call_response(call: ServiceCall, payload: bytes) -> bytes:
    """Return the bytes of an answer.

    Args:
        call: The call.
        payload: The response in the encoding of the call.
    """
    encoding = call.encoding.encode()
    return _CALL.pack(3, call.service_id, call.call_id, len(encoding)) + encoding + payload


def asset(request_id: int, content: bytes) -> bytes:
    """Return the bytes with a file."""
    return _ASSET.pack(4, request_id, 0, 0) + content


def asset_failure(request_id: int, message: str) -> bytes:
    """Return the bytes that say why there is no such file."""
    text = message.encode(errors="backslashreplace")
    return _ASSET.pack(4, request_id, 1, len(text)) + text


def _text(op: str, **fields: Any) -> bytes:
    return msgspec.json.encode({"op": op, **fields})
