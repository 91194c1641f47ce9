"""Sends the recorded requests of services again, and says what has become of them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

from actors.bags.player.played_service import PlayedService
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.bags.player.bag_source import BagSource
    from actors.bags.player.options import PlayerOptions
    from actors.bags.player.played_topic import DueMessage
    from actors.logging.limited_lines import LimitedLines
    from actors.node.node import Node

MAX_UNANSWERED: Final = 100
"""Requests that may wait for their replies; a further one is sent late rather than not at all. A slow service
gets no more calls at once than this, whatever the rate is."""


class ServiceRequests:
    """Sends the requests of a bag. Each has the node's deadline for calls.

    Args:
        node: The player's node.
        source: The services; what cannot be called is added to its problems, and logged once.
        options: Names.
        lines: Limits the lines about requests.

    Attributes:
        answered: Requests that have been answered.
        failed: Requests that ended with an error, or without a reply in time.
        unserved: Requests that were not sent: their service had no server when they were due.
    """

    def __init__(self, node: Node, source: BagSource, options: PlayerOptions, lines: LimitedLines) -> None:
        self._lines = lines
        self._log = node.get_logger()
        self._unanswered: set[asyncio.Future[bytes]] = set()
        self._clients: dict[str, Any] = {}
        """By the name that they call."""
        self.answered = self.failed = self.unserved = 0
        for topic in source.topics:
            if isinstance(topic, PlayedService):
                name = options.remappings.get(topic.srv_name, topic.srv_name)
                try:
                    topic.client = self._client(node, topic, name)
                except (CallboardError, TypeError, ValueError) as error:
                    problem = f"'{escape(topic.srv_name)}' is not called: {error}"
                    source.problems.append(problem)
                    self._log.warning(problem)

    def _client(self, node: Node, topic: PlayedService, name: str) -> Any:
        found = self._clients.get(name)
        if found is None:
            found = self._clients[name] = node.create_client(topic.srv_type, name, raw=True)
        elif found.srv_type is not topic.srv_type:
            raise TypeError(f"a part has another type, {escape(topic.bag_topic.type_name)}, than the rest")
        return found

    @property
    def has_services(self) -> bool:
        """Whether there is any service to call."""
        return bool(self._clients)

    async def send(self, message: DueMessage, topic: PlayedService) -> None:
        """Send a request, as soon as not too many wait for their replies.

        Args:
            message: The request.
            topic: Its service.
        """
        client = topic.client
        assert client is not None
        while len(self._unanswered) >= MAX_UNANSWERED:
            await asyncio.wait(self._unanswered, return_when=asyncio.FIRST_COMPLETED)
        if not client.service_is_ready():
            self.unserved += 1
            self._warn(f"A request is not sent: '{client.srv_name}' has no server")
            return
        try:
            future = client.call_async(message.data)
        except CallboardError as error:  # larger than the broker takes
            self._fail(error)
            return
        self._unanswered.add(future)
        future.add_done_callback(self._ended)
        topic.published += 1

    def _ended(self, future: asyncio.Future[bytes]) -> None:
        self._unanswered.discard(future)
        if future.cancelled():
            return
        error = future.exception()
        if error is None:
            self.answered += 1
        else:
            self._fail(error)

    def _fail(self, error: BaseException) -> None:
        self.failed += 1
        self._warn(f"A request has failed: {error}")

    def _warn(self, text: str) -> None:
        if self._lines.admits("requests that are not answered"):
            self._log.warning(text)

    async def finish(self) -> None:
        """Wait until all requests are answered or have failed; their deadlines limit that."""
        if self._unanswered:
            await asyncio.wait(self._unanswered)
