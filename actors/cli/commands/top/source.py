"""The data of the live view: samples of a broker and messages, through the command's hidden node."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, TypeVar

from actors.cli.hidden_node import graph_of
from actors.errors import BrokerUnreachable
from actors.interfaces.convert import message_to_yaml
from actors.interfaces.errors import InvalidMessageError
from actors.threads.errors import ThreadStopped
from actors.tools.generic_subscription import decoder_of, profile_of
from actors.tools.overview import Sample
from actors.tools.percentiles import Percentiles
from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.endpoints.subscription.subscription import Subscription
    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.node.node import Node
    from actors.threads.node_thread import NodeThread

T = TypeVar("T")
SHOWN_AT_ONCE: Final = 5
"""Messages kept until the next update; further ones are only counted."""
DEPTH: Final = 100
SHOWN_LENGTH: Final = 128
"""Characters or elements shown of a string or sequence, as in `topic echo`."""
SHOWN_LINES: Final = 30
"""Lines shown of a message."""


class ReceivedMessage(NamedTuple):
    """A message to show: its node, when it was sent, how long it took, and its text."""

    node: str
    sent_ns: int
    delay_s: float
    text: str


class Received(NamedTuple):
    """The messages since the last update.

    Attributes:
        messages: The newest.
        besides: The number of further messages.
        measured: The number of messages whose delays are known.
        p50_s, p99_s: Percentiles of these delays; None if there are none.
    """

    messages: list[ReceivedMessage]
    besides: int
    measured: int
    p50_s: float | None
    p99_s: float | None


class TopicReader(Protocol):
    """Receives one topic."""

    async def pop(self) -> Received:
        """Return the messages since the last update."""
        ...

    async def close(self) -> None:
        """Unsubscribe."""
        ...


class TopDataSource(Protocol):
    """The data of the view.

    Attributes:
        target: The broker's URLs and domain.
    """

    target: str

    async def sample(self) -> Sample:
        """Return a sample.

        Raises:
            BrokerUnreachable: There is no broker now.
        """
        ...

    async def listen(self, topic: str, snapshot: GraphSnapshot) -> TopicReader:
        """Subscribe to a topic."""
        ...


class NodeSource:
    """The data from a node in another thread: one thread draws while another one measures.

    Args:
        thread: The node's thread.
        node: An entered node.
        target: The broker's URLs and domain.
    """

    def __init__(self, thread: NodeThread, node: Node, target: str) -> None:
        self.target = target
        self._thread = thread
        self._node = node

    async def sample(self) -> Sample:
        """Return a sample."""
        return await _run_in(self._thread, self._sample)

    async def _sample(self) -> Sample:
        return Sample(await graph_of(self._node), await self._node.get_broker_stats())

    async def listen(self, topic: str, snapshot: GraphSnapshot) -> TopicReader:
        """Subscribe to a topic."""
        reader = NodeTopicReader(self._thread, self._node, topic, snapshot)
        await reader.open()
        return reader


class NodeTopicReader:
    """Receives one topic through a node; keeps the newest messages undecoded until `take`.

    Args:
        thread: The node's thread.
        node: The node that subscribes.
        topic: The topic's full name.
        snapshot: The graph.
    """

    def __init__(self, thread: NodeThread, node: Node, topic: str, snapshot: GraphSnapshot) -> None:
        self._thread = thread
        self._node = node
        self._topic = topic
        self._decode = decoder_of(snapshot, topic)
        self._profile = profile_of(snapshot, topic, depth=DEPTH)
        self._waiting: deque[tuple[bytes, MessageInfo]] = deque(maxlen=SHOWN_AT_ONCE)
        self._delays = Percentiles()
        self._known = 0
        self._since_ns = time.time_ns()
        self._subscription: Subscription[Any] | None = None

    async def open(self) -> None:
        """Subscribe."""
        await _run_in(self._thread, self._open)

    async def _open(self) -> None:
        self._subscription = self._node.create_subscription(
            None, self._topic, self._receive, self._profile, raw=True
        )

    def _receive(self, data: bytes, info: MessageInfo) -> None:
        self._waiting.append((data, info))
        if info.source_timestamp >= self._since_ns:  # the age of a latched message is no delay
            self._delays.add(_delay(info))

    async def pop(self) -> Received:
        """Return the messages since the last update."""
        waiting, received = await _run_in(self._thread, self._pop)
        for data, info in waiting:
            text = shown(data, self._decode)
            received.messages.append(
                ReceivedMessage(info.publisher_node, info.source_timestamp, _delay(info), text)
            )
        return received

    async def _pop(self) -> tuple[list[tuple[bytes, MessageInfo]], Received]:
        assert self._subscription is not None
        waiting = list(self._waiting)
        self._waiting.clear()
        known = self._subscription.received + self._subscription.dropped + self._subscription.lost
        besides = max(0, known - self._known - len(waiting))
        self._known = known
        delays = self._delays
        return waiting, Received([], besides, len(delays), delays.at(0.5), delays.at(0.99))

    async def close(self) -> None:
        """Unsubscribe."""
        await _run_in(self._thread, self._close)

    async def _close(self) -> None:
        assert self._subscription is not None
        self._node.destroy_subscription(self._subscription)


async def _run_in(thread: NodeThread, work: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Return the result of a coroutine function that runs in the node's thread.

    Raises:
        BrokerUnreachable: The thread has ended.
    """
    try:
        return await asyncio.wrap_future(thread.submit(work))
    except ThreadStopped:
        raise BrokerUnreachable("The node has ended") from None


def _delay(info: MessageInfo) -> float:
    return (info.received_timestamp - info.source_timestamp) / 1e9


def shown(data: bytes, decode: Callable[[bytes], Any]) -> str:
    """Return a message as YAML, truncated, without control characters."""
    try:
        message = decode(data)
        lines = _lines(message, no_arr=False)
        if len(lines) > SHOWN_LINES:  # such as an image: its size says more than its first pixels
            lines = _lines(message, no_arr=True)
    except InvalidMessageError as error:
        return sanitize(str(error))
    if len(lines) > SHOWN_LINES:
        lines = [*lines[:SHOWN_LINES], f"... {len(lines) - SHOWN_LINES} more lines"]
    return "\n".join(lines)


def _lines(message: Message | dict[str, Any], *, no_arr: bool) -> list[str]:
    text = message_to_yaml(message, truncate_length=SHOWN_LENGTH, no_arr=no_arr)
    return sanitize(text).rstrip("\n").split("\n")
