"""Calls services and publishes single messages for requests of browsers and programs."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

import msgspec

from actors.errors import ServiceOverloaded, ServiceUnavailable
from actors.interfaces.codec import codec_for
from actors.interfaces.convert import message_from_fields
from actors.interfaces.decode_budget import Allowance
from actors.interfaces.message import Message
from actors.qos.profile import DurabilityPolicy, QoSProfile
from actors.time.timeout import DEFAULT_TIMEOUT
from actors.tools.stamps import Stamps
from actors.web.javascript_values import message_to_javascript
from actors.web.node_names import NODE_NAMES
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping

    from actors.graph.snapshot import GraphSnapshot
    from actors.tools.graph_types import GraphTypes
    from actors.web.observer import Observer

MAX_CALLS: Final = 64
"""Calls that wait for their replies at the same time."""

MATCH_SEC: Final = 5.0
"""Until a new client and a server in the graph have been matched; it takes milliseconds."""

FLUSH_SEC: Final = 5.0
"""Time for a published message to reach the broker."""

MAX_REASON: Final = 500
"""Characters of a string about a value, which may be as long as the value."""

M = TypeVar("M", bound=Message)


class RequestError(CallboardError):
    """The request does not fit the type; the message names the field."""


class Calls:
    """Calls services and publishes messages in the name of the web server.

    Args:
        observer: Has the node that calls and publishes, and the graph.
        types: The graph's classes.
    """

    def __init__(self, observer: Observer, types: GraphTypes) -> None:
        self._observer, self._node = observer, observer.node
        self._types = types
        self._waiting = 0

    async def call(
        self, service: str, values: Mapping[str, Any], wanted: str, timeout_sec: float | None
    ) -> Any:
        """Call a service once; the call is cancelled with the caller.

        Args:
            service: Its full name.
            values: The fields of the request.
            wanted: The type's name, needed if the graph has several; else empty.
            timeout_sec: For the reply; None is the node's default.

        Returns:
            The fields of the response; see `message_to_javascript`.

        Raises:
            RequestError: The values do not fit.
            TooManyValuesError: The response has too many.
            CallFailed: There is no server, no reply in time, or the handler raised.
            UnknownInterfaceError, InvalidMessageError: See `GraphTypes`.
            BrokerUnreachable: There is no broker now.
        """
        snapshot = await self._observer.newest_around(service)
        if not snapshot.count(EntryKind.SERVICE, service):
            raise ServiceUnavailable(f"Service '{service}' has no server now")
        srv_type: Any = await self._types.service(snapshot, service, wanted)
        work = self._observer.work
        request = await work.run(message_of, srv_type.Request, values)
        return await work.run(
            message_to_javascript, await self.request(srv_type, service, request, timeout_sec)
        )

    async def request(
        self, srv_type: Any, service: str, request: Message, timeout_sec: float | None = None
    ) -> Message:
        """Call a service once with a message; the call is cancelled with the caller.

        Args:
            srv_type: The class of the service.
            service: Its full name.
            request: The request.
            timeout_sec: For the reply; None is the node's default.

        Returns:
            The response.

        Raises:
            CallFailed: As for `call`.
        """
        with self._counted():
            client = self._node.create_client(srv_type, service)
            try:
                if not await client.wait_for_service(MATCH_SEC):
                    raise ServiceUnavailable(f"Service '{service}' has no server of this type now")
                limit = DEFAULT_TIMEOUT if timeout_sec is None else timeout_sec
                response: Message = await client.call(request, limit)
                return response
            finally:
                client.destroy()

    async def publish(self, topic: str, values: Mapping[str, Any], wanted: str) -> int:
        """Publish one message.

        Args:
            topic: Its full name.
            values: The fields of the message.
            wanted: The type's name, needed if the graph has none or several; else empty.

        Returns:
            How many matching subscriptions others have.

        Raises:
            RequestError: The values do not fit.
            UnknownInterfaceError, InvalidMessageError: See `GraphTypes`.
            BrokerUnreachable: There is no broker now.
            PublisherRefused: The broker refuses the publisher.
            WaitTimeout: The message did not reach the broker in time.
        """
        snapshot = await self._observer.newest_around(topic)
        msg_type = await self._types.message(snapshot, topic, wanted)
        message = await self._observer.work.run(message_of, msg_type, values)
        with self._counted():
            publisher = self._node.create_publisher(msg_type, topic, publishing_profile(snapshot, topic))
            try:
                # The broker answers the publisher before that.
                after = await self._observer.newest()
                publisher.publish(message)
                await publisher.flush(FLUSH_SEC)
                return publisher.get_subscription_count() - self._own_subscriptions(after, topic)
            finally:
                publisher.destroy()

    def _own_subscriptions(self, snapshot: GraphSnapshot, topic: str) -> int:
        """Return how many subscriptions of a topic are there for pages that show it."""
        subscriptions = snapshot.of_kind(EntryKind.SUBSCRIPTION)
        return sum(entry.name == topic and entry.node in NODE_NAMES for entry in subscriptions)

    @contextmanager
    def _counted(self) -> Generator[None]:
        if self._waiting >= MAX_CALLS:
            raise ServiceOverloaded(f"{MAX_CALLS} calls of this web server are waiting already")
        self._waiting += 1
        try:
            yield
        finally:
            self._waiting -= 1


def message_of(msg_type: type[M], values: Mapping[str, Any]) -> M:
    """Return a message with the values of a JSON object; `auto` and `now` are times, as for `topic pub`.

    Args:
        msg_type: Its class.
        values: Field name to value; other fields have their defaults.

    Raises:
        RequestError: A value does not fit its field, or so many fields are left out that the message would
            take far more memory than the values.
    """
    try:
        fields, stamps = Stamps.taken_from(msg_type, values)
        # An element of three bytes, `{}`, asks for a whole message here as it does where messages arrive.
        encoded = msgspec.msgpack.encode(fields)
        budget = codec_for(msg_type).budget
        if len(encoded) > budget.unchecked:
            budget.check(encoded, Allowance())
        message = message_from_fields(msg_type, fields)
    except RecursionError:
        raise RequestError("The values are nested too deeply") from None
    except (AttributeError, OverflowError, TypeError, ValueError) as error:
        text = str(error)
        raise RequestError(text if len(text) <= MAX_REASON else f"{text[:MAX_REASON]}…") from None
    stamps.set(message, time.time_ns())
    return message


def publishing_profile(snapshot: GraphSnapshot, topic: str) -> QoSProfile:
    """Return a profile that suits the topic: a publisher's, or what its subscriptions ask for.

    Args:
        snapshot: The graph, or the part that has the topic.
        topic: The topic's full name.
    """
    offers = snapshot.endpoints(EntryKind.PUBLISHER, topic)
    if offers:
        return offers[0].qos_profile
    asked = [each.qos_profile.durability for each in snapshot.endpoints(EntryKind.SUBSCRIPTION, topic)]
    latched = DurabilityPolicy.TRANSIENT_LOCAL in asked
    return QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    )
