"""What the brokers of a mesh tell each other about one graph, as data.

An endpoint is known by its broker and its number there; together they are its key: `broker << 32 | number`. A
frame between brokers has numbers where a frame between a node and its broker has ids. Keys of publishers are
the ids in BATCH frames, so that these pass unchanged.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from proto.wire.frames import Assert, Batch, Buffer, Frame


class Change(NamedTuple):
    """To all brokers: an endpoint was added or removed. `version` starts at 1 and has no gaps."""

    version: int
    frame: Frame
    """A declaration, RETIRE or UNDECLARE."""


class Held(NamedTuple):
    """A publisher that waits for credit, or whose last message is latched and not old.

    `next_sequence`: its next number. `brokers`: those whose subscriptions it waits for.
    """

    next_sequence: int
    brokers: tuple[int, ...] = ()


class Heartbeat(NamedTuple):
    """To all brokers, once a second: what they should have received.

    Attributes:
        version: The last change.
        sent: By broker, the epoch, and how many direct messages it was sent in it.
        held: Publishers by their numbers.
    """

    version: int
    sent: dict[int, tuple[int, int]]
    held: Mapping[int, Held] = MappingProxyType({})


class Publish(NamedTuple):
    """To all brokers that subscribe to a topic: an encoded BATCH or ASSERT frame."""

    topic: str
    raw: Buffer


class Direct(NamedTuple):
    """To one broker: a frame about its endpoints or about this broker's.

    `number` begins with 1 in each epoch and has no gaps (see `broker_session.py`).

    | frame | its numbers are of | `endpoint` |
    |---|---|---|
    | ATTACHED, REPLAY | the receiver's subscriptions | first number that will follow |
    | GRANT | the sender's subscription | |
    | REQUEST, CANCEL | the sender's client | number of the receiver's server |
    | REPLY | the receiver's client | number of the sender's server |
    | DESCRIBE, DEFINITION, PING, PONG | | |
    """

    broker: int
    epoch: int
    number: int
    endpoint: int
    frame: Frame


class Subscribe(NamedTuple):
    """To the engine: messages of a topic are wanted from now on, or not any more."""

    topic: str
    wanted: bool


class Ask(NamedTuple):
    """To one broker: its snapshot is needed. `epoch`: of the session with it."""

    broker: int
    epoch: int


class Snapshot(NamedTuple):
    """The endpoints of a broker after `version` changes, nodes before their endpoints.

    Attributes:
        epoch: Of its session with the broker that has asked; 0 for none.
        version: The number of changes that it includes.
        declarations: Frames that declare the endpoints. Iterating over those of another broker raises
            ProtocolError at one that is malformed.
        name: The broker's name in lists and logs.
        software: Its version of callboard.
        sourced: Whether all its samples name their source.
        size: The memory of those that are not decoded yet.
    """

    epoch: int
    version: int
    declarations: Collection[Frame]
    name: str = ""
    software: str = ""
    sourced: bool = False
    size: int = 0


Message: TypeAlias = "Change | Heartbeat | Publish | Direct | Subscribe | Ask"
Received: TypeAlias = "Change | Direct | Batch | Assert"
"""Messages that keep their order."""
