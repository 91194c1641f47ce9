"""What tests read or set inside a node, where no public name has it."""

from __future__ import annotations

from contextlib import contextmanager
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from actors.graph.inspector import Inspector
from actors.logging import sinks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    import pytest

    from actors import Client, Clock, Node, ParameterEventHandler, Subscription
    from actors.callbacks.deadlines import Deadlines
    from actors.endpoints.context import NodeContext
    from actors.graph.view import BrokerView
    from actors.session.attachments import Attachments
    from actors.session.connection import BrokerConnection
    from actors.session.link import Link
    from actors.session.shared_memory import SharedMemory
    from proto.wire.url import BrokerUrl


def context_of(node: Node) -> NodeContext:
    """Return what a node's parts share: its users see what the parts do."""
    return node._context


def link_of(node: Node) -> Link:
    """Return a node's link to its broker: tests cut, fill and look into it."""
    return node._context.link


def endpoints_of(node: Node) -> tuple[Any, ...]:
    """Return a node's endpoints with all that they have: the node itself knows them by a protocol."""
    return tuple(node._context.endpoints)


def queries_of(node: Node) -> BrokerView:
    """Return a node's questions to its broker, which a test asks with a deadline of its own."""
    return node._broker


def connection_of(node: Node) -> BrokerConnection:
    """Return a node's established connection, to let frames arrive within a callback."""
    connection = node._node_runner._connector._connection
    assert connection is not None
    return connection


def unsent_publishers(link: Link) -> int:
    """Return how many publishers have messages that this turn of the loop has not put into a queue."""
    return len(link._dirty)


@contextmanager
def invalid_requests(client: Client[Any, Any], body: bytes = b"\xa1x") -> Iterator[None]:
    """Let a client send requests that no server can decode: the public codec makes none."""
    codec = client._requests
    client._requests = SimpleNamespace(encode=lambda _: body)
    try:
        yield
    finally:
        client._requests = codec


def note_greetings(monkeypatch: pytest.MonkeyPatch, note: Callable[[float], None]) -> None:
    """Note the deadline that an inspector gives to each broker that it greets."""
    greet = Inspector._greet

    def noted(inspector: Inspector, url: BrokerUrl, deadline: float) -> None:
        note(deadline)
        greet(inspector, url, deadline)

    monkeypatch.setattr(Inspector, "_greet", noted)


def limit_questions(inspector: Inspector, seconds: float) -> None:
    """Let the next questions of an inspector wait this long; its connection may have taken longer."""
    inspector._timeout_sec = seconds


def subscription_of(handler: ParameterEventHandler) -> Subscription[Any]:
    """Return the subscription of a handler, which is ready when it is matched."""
    return handler._subscription


def readers_of(memory: SharedMemory) -> dict[int, Any]:
    """Return what reads the arenas of others, by their numbers."""
    return memory._readers


def all_released(memory: SharedMemory) -> bool:
    """Return whether the broker has referred to a node's arena and has released everything in it."""
    return memory._references is not None and not memory._references.held_bytes


def readers_by_publisher(attachments: Attachments) -> dict[int, Any]:
    """Return the readers of each publisher: only that table shows that an empty entry is left."""
    return attachments._attachments


def publishers_by_reader(attachments: Attachments) -> dict[int, set[int]]:
    """Return the publishers of each reader, by which one that leaves is found."""
    return attachments._publishers


def suspended_attachments(attachments: Attachments) -> dict[Any, Any]:
    """Return the attachments of suspended publishers."""
    return attachments._suspended


def kept_entries(deadlines: Deadlines) -> int:
    """Return how many entries are kept, those of finished calls included."""
    return len(deadlines._heap)


def has_timer(deadlines: Deadlines) -> bool:
    """Return whether the loop holds a timer for deadlines."""
    return deadlines._timer is not None


def sleepers(clock: Clock) -> int:
    """Return how many sleeps a clock keeps."""
    return len(clock._sleepers)


def sinks_lock() -> AbstractContextManager[Any]:
    """Return the lock of all sinks, which a thread may hold during a fork."""
    return sinks._lock
