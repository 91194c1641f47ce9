"""What the brokers of a mesh tell each other about one graph, as data.

An endpoint is known by its broker and its number there; together they are its key: `broker << 32 | number`. A
frame between brokers has numbers where a frame between a node and its broker has ids. Keys of publishers are
the ids in BATCH frames, so that these pass unchanged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from proto.frames import Buffer, Frame


class Change(NamedTuple):
    """To all brokers: an endpoint has come or gone. `version` begins with 1 and has no gaps."""

    version: int
    frame: Frame
    """A declaration, or UNDECLARE."""


class Publish(NamedTuple):
    """To all brokers that subscribe to the topic: a BATCH or ASSERT frame, encoded."""

    topic: str
    raw: Buffer


class Direct(NamedTuple):
    """To one broker: a frame about its endpoints or about this broker's.

    | frame | its numbers are of | `endpoint` |
    |---|---|---|
    | ATTACHED, REPLAY | the receiver's subscriptions | first number that will follow |
    | GRANT | the sender's subscription | |
    | REQUEST, CANCEL | the sender's client | number of the receiver's server |
    | REPLY | the receiver's client | number of the sender's server |
    """

    broker: int
    frame: Frame
    endpoint: int = 0


class Subscribe(NamedTuple):
    """To the engine: messages of a topic are wanted from now on, or not any more."""

    topic: str
    wanted: bool


Message: TypeAlias = Change | Publish | Direct | Subscribe


class Snapshot(NamedTuple):
    """The endpoints of a broker after `version` changes, nodes before their endpoints."""

    version: int
    declarations: tuple[Frame, ...]
