"""A service whose recorded requests are sent again: what of its events is a request."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final, cast

from actors.bags.player.played_topic import PlayedTopic
from actors.endpoints.service_introspection import TOPIC_SUFFIX, EventKind
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.runtime_types import service_of_event

if TYPE_CHECKING:
    from actors.bags.contents.records import BagTopic
    from actors.endpoints.client.client import Client

_ACTION: Final = "/_action/"


class RequestsSource(StrEnum):
    """Whose events say which requests are sent again: a call between two ends may have events of both."""

    SERVICE = "service_introspection"
    """The servers': each request that a server received."""
    CLIENT = "client_introspection"
    """The clients': each request that a client sent."""


_KINDS: Final = {
    RequestsSource.SERVICE: EventKind.REQUEST_RECEIVED,
    RequestsSource.CLIENT: EventKind.REQUEST_SENT,
}


def has_service_events(topic: BagTopic) -> bool:
    """Return whether a topic has the events of a service; those of an action's services do not count.

    Args:
        topic: As the bag has it.
    """
    name, type_name = topic.name, topic.type_name
    is_event = "/srv/" in type_name and type_name.endswith("_Event")
    return is_event and name.endswith(TOPIC_SUFFIX) and _ACTION not in name


class PlayedService(PlayedTopic):
    """A service whose recorded requests are sent again.

    Args:
        bag_topic: The topic of its events.
        source: Which of them are requests.

    Attributes:
        srv_type: The service class.
        srv_name: The service's name in the bag.
        client: Sends the requests; None: they are not sent.
        published: Requests that have been sent.

    Raises:
        InvalidMessageError: As for `PlayedTopic`, or its messages are no service events.
    """

    __slots__ = ("_encode_request", "_kind", "client", "srv_name", "srv_type")

    def __init__(self, bag_topic: BagTopic, source: RequestsSource) -> None:
        super().__init__(bag_topic)
        self.srv_type = cast("Any", service_of_event(self.msg_type))
        self.srv_name = bag_topic.name.removesuffix(TOPIC_SUFFIX)
        self.client: Client[bytes, bytes] | None = None
        self._kind = _KINDS[source]
        self._encode_request = codec_for(self.srv_type.Request).encode

    @property
    def is_played(self) -> bool:
        """Whether its events are read."""
        return self.client is not None

    def to_msgpack(self, data: bytes) -> bytes | None:
        """Return the request of an event as msgpack; None if it is about something else.

        Args:
            data: The event as CDR.

        Raises:
            InvalidMessageError: As for `PlayedTopic`, or the event of a request is without the request.
        """
        event: Any = self._decode(data)
        if event.info.event_type != self._kind:
            return None
        if not event.request:
            raise InvalidMessageError("the event of a request is without the request, as METADATA asks for")
        return self._encode_request(event.request[0])
