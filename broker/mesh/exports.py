"""What a broker tells the others of a mesh about its own endpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.mesh.messages import Change
from broker.records import (
    ClientRecord,
    Endpoint,
    NodeRecord,
    PublisherRecord,
    ServiceRecord,
    SubscriptionRecord,
)
from proto import frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.frames import Frame


class MeshExports:
    """The endpoints of one graph that its own nodes have declared (`declarations.Exports`).

    Args:
        emit: Takes each change.
        touch: Takes the topic of each subscription that comes or goes.
        mesh: The id of the router's peer for the mesh.

    Attributes:
        version: The number of changes so far.
    """

    def __init__(self, emit: Callable[[Change], None], touch: Callable[[str], None], mesh: int) -> None:
        self._emit = emit
        self._touch = touch
        self._mesh = mesh
        self.version = 0
        self._declarations: dict[int, Frame] = {}
        self._leaving: dict[int, Endpoint] = {}
        """By key, publishers that are gone and whose last messages are still to be sent, and their nodes."""

    def declarations(self) -> tuple[Frame, ...]:
        """Return all that is declared, nodes first."""
        return tuple(sorted(self._declarations.values(), key=lambda frame: type(frame) is not frames.Node))

    def joined(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is new or back."""
        frame = self._declarations[endpoint.number] = declaration_of(endpoint)
        if isinstance(endpoint, SubscriptionRecord):
            self._touch(endpoint.name)
        if endpoint.key in self._leaving:
            self.sent_all(endpoint.key)
        self._change(frame)

    def left(self, endpoint: Endpoint) -> None:
        """Note an endpoint that is gone or suspended."""
        if self._declarations.pop(endpoint.number, None) is None:
            return
        if isinstance(endpoint, PublisherRecord):
            waits = self._mesh in endpoint.routes
        else:
            waits = any(each.node is endpoint for each in self._leaving.values())
        if waits:
            self._leaving[endpoint.key] = endpoint
        else:
            self._change(frames.Undeclare(endpoint.number))
        if isinstance(endpoint, SubscriptionRecord):
            self._touch(endpoint.name)

    def leaving(self, publisher: int) -> Endpoint | None:
        """Return a publisher that is gone and whose last messages are still to be sent, or None."""
        return self._leaving.get(publisher)

    def sent_all(self, publisher: int) -> None:
        """Note that the last message of a publisher that is gone has been sent, if it is gone."""
        endpoint = self._leaving.pop(publisher, None)
        if endpoint is None:
            return
        self._change(frames.Undeclare(endpoint.number))
        node = endpoint.node
        if node is not None and not any(each.node is node for each in self._leaving.values()):
            self.sent_all(node.key)

    def _change(self, frame: Frame) -> None:
        self.version += 1
        self._emit(Change(self.version, frame))


def declaration_of(endpoint: Endpoint) -> Frame:
    """Return the frame that declares an endpoint to other brokers, with numbers and the public gid."""
    number = endpoint.number
    if isinstance(endpoint, NodeRecord):
        return frames.Node(number, endpoint.name, endpoint.shared)
    assert endpoint.node is not None
    node, name = endpoint.node.number, endpoint.name
    type_name, type_hash = endpoint.type_name, endpoint.type_hash
    if isinstance(endpoint, PublisherRecord):
        return frames.Publisher(
            number,
            node,
            name,
            type_name,
            type_hash,
            endpoint.qos,
            endpoint.gid,
            endpoint.next_sequence,
            None,
            endpoint.live_sequence,
        )
    if isinstance(endpoint, SubscriptionRecord):
        return frames.Subscription(
            number,
            node,
            name,
            type_name or None,
            type_hash or None,
            endpoint.qos,
            endpoint.window_messages,
            endpoint.window_bytes,
            endpoint.stall_ms,
        )
    if isinstance(endpoint, ServiceRecord):
        return frames.Service(number, node, name, type_name, type_hash, None)
    assert isinstance(endpoint, ClientRecord)
    return frames.Client(number, node, name, type_name, type_hash)
