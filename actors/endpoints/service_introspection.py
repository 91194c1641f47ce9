"""Service introspection: a client or a server publishes events of its calls, on a topic beside the service.

The topic of the service `/add` is `/add/_service_event`, which tools hide; its messages are
`AddTwoInts.Event`. A call between two ends that both publish events has four of them: REQUEST_SENT (the
client), REQUEST_RECEIVED (the server, as its handler begins), RESPONSE_SENT and RESPONSE_RECEIVED. A call
that ends with an error has no response, and therefore no event of one.

Introspection never harms the call: an event that cannot be published is dropped, counted and logged.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

from actors.endpoints.endpoint import Endpoint, Handle
from actors.endpoints.publisher.publisher import Publisher
from actors.errors import PublisherFull
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.qos.profile import qos_from
from proto import limits
from proto.wire.names import validate_full_topic_name

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.interfaces.codec import Encoded
    from actors.qos.profile import QoSProfile
    from actors.time.clock import Clock
    from proto.wire.frames import Options

TOPIC_SUFFIX: Final = "/_service_event"

_GID: Final = "client_gid"
_NUMBER: Final = "sequence_number"
_MAX_INT64: Final = 2**63 - 1
_WARN_EVERY_SEC: Final = 10.0


class ServiceIntrospectionState(IntEnum):
    """How much a client or a server publishes of its calls."""

    OFF = 0
    """Nothing."""
    METADATA = 1
    """What happened, when, in which call."""
    CONTENTS = 2
    """Requests and responses, too."""


class EventKind(IntEnum):
    """Kinds of service events; the numbers are those of service_msgs/msg/ServiceEventInfo."""

    REQUEST_SENT = 0
    REQUEST_RECEIVED = 1
    RESPONSE_SENT = 2
    RESPONSE_RECEIVED = 3


class CallIdentity(NamedTuple):
    """Which call it is, the same at both ends.

    Attributes:
        client_gid: 16 bytes that name the client.
        sequence_number: The client's number for the call, from 1.
    """

    client_gid: bytes
    sequence_number: int

    def attributes(self) -> Options:
        """Return it as a request carries it (docs/protocol.md §7.8)."""
        return {_GID: self.client_gid, _NUMBER: self.sequence_number}

    @classmethod
    def of(cls, attributes: Options | None, call: int) -> CallIdentity:
        """Read a request's attributes; without them the gid is zero, and the number the broker's."""
        known = attributes or {}
        gid, number = known.get(_GID), known.get(_NUMBER)
        if not isinstance(gid, bytes) or len(gid) != limits.INSTANCE_BYTES:
            gid = bytes(limits.INSTANCE_BYTES)
        if type(number) is not int or not 0 <= number <= _MAX_INT64:
            number = call & _MAX_INT64
        return cls(gid, number)


class ServiceEvents:
    """The events of one client or server. They are published until `close`.

    Args:
        endpoint: The client or server.
        clock: Stamps the events.
        qos: The topic's.
        contents: Whether events contain requests and responses.

    Attributes:
        lost: Events that could not be published: the topic was full, the event too large for the broker, or
            an encoded request or response not a message of its type.

    Raises:
        InvalidTopicNameError: The service's name leaves no space for the topic's.
    """

    def __init__(
        self, endpoint: IntrospectedEndpoint, *, clock: Clock, qos: QoSProfile, contents: bool
    ) -> None:
        from actors.interfaces.service_event import service_event  # noqa: PLC0415 - only with introspection

        topic = endpoint.srv_name + TOPIC_SUFFIX
        validate_full_topic_name(topic)
        self.lost = 0
        self._log = endpoint.context.log
        self._clock = clock
        self._contents = contents
        self._srv_type: Any = endpoint.srv_type
        self._event_type: type[Any] = service_event(self._srv_type)
        self._publisher = Publisher(endpoint.context, self._event_type, topic, qos)

    def request(self, kind: EventKind, identity: CallIdentity, request: Message | Encoded) -> None:
        """Publish that a request was sent or received."""
        self._publish(kind, identity, "request", self._srv_type.Request, request)

    def response(self, kind: EventKind, identity: CallIdentity, response: Message | Encoded) -> None:
        """Publish that a response was sent or received."""
        self._publish(kind, identity, "response", self._srv_type.Response, response)

    def _publish(
        self,
        kind: EventKind,
        identity: CallIdentity,
        part: str,
        part_type: type[Message],
        content: Message | Encoded,
    ) -> None:
        publisher = self._publisher
        if publisher.destroyed:
            return  # the node stops
        event = self._event_type()
        event.info.event_type = kind
        event.info.stamp = self._clock.now().to_msg()
        event.info.client_gid, event.info.sequence_number = identity
        try:
            if self._contents:
                message = content if isinstance(content, Message) else codec_for(part_type).decode(content)
                setattr(event, part, [message])
            publisher.publish(event)
        except (PublisherFull, InvalidMessageError) as error:
            self.lost += 1
            self._log.warning(
                f"Dropped a service event ({self.lost} so far): {error}",
                throttle_duration_sec=_WARN_EVERY_SEC,
            )

    def close(self) -> None:
        """Publish nothing more."""
        self._publisher.destroy()


class IntrospectedEndpoint(Endpoint):
    """A client or a service, as the runtime holds it.

    Attributes:
        srv_type: The service class.
        srv_name: The full name of the service.
        service_events: Publishes events of its calls; None unless introspection is configured.
    """

    def __init__(self, context: NodeContext, srv_type: type, srv_name: str) -> None:
        super().__init__(context)
        self.interface = self.srv_type = srv_type
        self.srv_name = srv_name
        self.service_events: ServiceEvents | None = None

    def destroy(self) -> None:
        """Take it out of service, and its events."""
        if self.service_events is not None:
            self.service_events.close()
        super().destroy()


E = TypeVar("E", bound=IntrospectedEndpoint)


class Introspectable(Handle[E]):
    """A client or a service, as users hold it.

    Attributes:
        srv_type: The service class.
        srv_name: The full name of the service.
    """

    def __init__(self, endpoint: E) -> None:
        super().__init__(endpoint)
        self.srv_type = endpoint.srv_type
        self.srv_name = endpoint.srv_name

    @property
    def service_name(self) -> str:
        """The full name of the service."""
        return self.srv_name

    @property
    def events_lost(self) -> int:
        """Service events that could not be published since introspection was configured."""
        events = self._endpoint.service_events
        return 0 if events is None else events.lost

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile | int,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Publish events of calls on the topic `<service>/_service_event`, or stop doing so.

        Args:
            clock: Stamps the events.
            service_event_qos_profile: The topic's; a profile or a depth.
            introspection_state: OFF (as at first), METADATA, or CONTENTS: requests and responses, too.

        Raises:
            InvalidTopicNameError: The service's name leaves no space for the topic's.
            NodeDestroyed: The client or service has been destroyed.
            TypeError: `service_event_qos_profile` is neither a profile nor a depth.
            ValueError: The depth is negative, or there is no such state.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        state, qos = ServiceIntrospectionState(introspection_state), qos_from(service_event_qos_profile)
        before, after = endpoint.service_events, None
        if state is not ServiceIntrospectionState.OFF:
            contents = state is ServiceIntrospectionState.CONTENTS
            after = ServiceEvents(endpoint, clock=clock, qos=qos, contents=contents)
        endpoint.service_events = after
        if before is not None:
            before.close()
