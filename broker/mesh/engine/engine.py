"""The interface between a broker and the engine that carries its messages to other brokers, such as Zenoh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping

    from broker.mesh.mesh import Mesh
    from broker.mesh.messages import Message


@dataclass(slots=True)
class Traffic:
    """Messages of all domains: sent to one other broker alone, and received from it."""

    sent: int = 0
    bytes_sent: int = 0
    received: int = 0
    bytes_received: int = 0


class EngineStats(NamedTuple):
    """The numbers of an engine.

    Attributes:
        traffic: By the numbers of other brokers that are alive.
        sent, bytes_sent: Messages to them and to all.
        sending_bytes: Bytes of them that wait for the network.
        unhandled_bytes: Received bytes that wait for the event loop.
        overruns: Received messages that had to be dropped because the event loop was too slow.
        failed: Messages that could not be sent.
        malformed: Received messages that could not be decoded.
        neighbours: The ids of the brokers and routers with which there is a connection. The id of a broker is
            its number in hexadecimal.
    """

    traffic: Mapping[int, Traffic]
    sent: int = 0
    bytes_sent: int = 0
    sending_bytes: int = 0
    unhandled_bytes: int = 0
    overruns: int = 0
    failed: int = 0
    malformed: int = 0
    neighbours: tuple[str, ...] = ()


class Engine(Protocol):
    """Carries messages between brokers. It calls its host in the event loop."""

    @property
    def full(self) -> bool:
        """Whether it accepts no more messages now. It calls `Host.flush` when it does again."""
        ...

    async def start(self) -> None:
        """Connect to other brokers."""
        ...

    def join(self, domain: int) -> None:
        """Take part in the graph of a domain."""
        ...

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages about one graph, in order."""
        ...

    def statistics(self) -> EngineStats:
        """Return its numbers."""
        ...

    async def stop(self) -> None:
        """Send the messages that wait, and disconnect."""
        ...


class Host(Protocol):
    """The broker that uses an engine."""

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on.

        The engine calls its `add_broker`, `remove_broker`, `accept_snapshot`, `accept_heartbeat` and
        `receive`, and answers other brokers with its `snapshot`.
        """
        ...

    def flush(self) -> None:
        """Send what the router has returned. The engine calls it after the methods of a mesh."""
        ...

    def warn(self, reason: str, text: str, *values: object) -> None:
        """Log a warning, or count it if there are many of one reason (`PeerWarnings.warn`)."""
        ...
