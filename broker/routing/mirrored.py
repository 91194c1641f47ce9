"""What the mesh tells a router beyond the frames of nodes: endpoints of other brokers keep their keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from proto.wire import frames


class Mirror(NamedTuple):
    """Declares an endpoint that another broker has accepted.

    Attributes:
        declaration: Its frame, with an id that the mesh chooses, and the public gid of a publisher.
        key: Its key at the other broker.
    """

    declaration: Any
    key: int


class Open(NamedTuple):
    """The messages of another broker's publisher arrive from now on.

    Attributes:
        publisher: Its key.
        next_sequence: The number of the first message.
        live_sequence: Messages with smaller numbers are latched ones.
        subscriptions: Keys of those for which nothing is left out from `live_sequence` on.
    """

    publisher: int
    next_sequence: int
    live_sequence: int
    subscriptions: tuple[int, ...]


class Forward(NamedTuple):
    """Requests to the server with this key, which another broker has chosen."""

    server: int
    request: frames.Request


Mirrored: TypeAlias = Mirror | Open | Forward
