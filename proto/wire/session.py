"""The session as a state machine: which frames are allowed in which state, and which state follows.

Both roles use the same tables, so that the two ends cannot disagree. docs/protocol.md shows the diagram that
`diagram()` generates from them.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final, TypeAlias, get_args

from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.frames import Frame


class Role(Enum):
    """Which end of the link this is."""

    CLIENT = "client"
    BROKER = "broker"


class State(Enum):
    """The state of a session."""

    START = "START"
    GREETED = "GREETED"
    OPEN = "OPEN"
    CLOSING = "CLOSING"
    CLOSED = "CLOSED"


FrameType: TypeAlias = type[Frame]
Moves: TypeAlias = Mapping[FrameType, State]

_EITHER: frozenset[FrameType] = frozenset(
    {frames.Ping, frames.Pong, frames.Batch, frames.Fragment, frames.Abort, frames.Credit}
    | {frames.Request, frames.Reply, frames.Cancel, frames.Assert}
    | {frames.Arena, frames.Mapped, frames.Reference, frames.Release}
)
FROM_CLIENT: frozenset[FrameType] = _EITHER | {
    *get_args(frames.Declaration),
    *(frames.Grant, frames.Watch, frames.Unwatch, frames.Describe, frames.Inspect, frames.Proof),
}
"""The frames that a client may send in an open session."""

FROM_BROKER: frozenset[FrameType] = _EITHER | {
    *get_args(frames.DeclarationEvent),
    *(frames.Replay, frames.Graph, frames.Definition, frames.Stats, frames.Unmap),
}
"""The frames that a broker may send in an open session."""


def _open(received: frozenset[FrameType]) -> Mapping[State, Moves]:
    ends: Moves = {frames.Goodbye: State.CLOSING, frames.Error: State.CLOSED}
    return {
        State.OPEN: {**dict.fromkeys(received, State.OPEN), **ends},
        State.CLOSING: {**dict.fromkeys(received, State.CLOSING), **ends},
        State.CLOSED: {},
    }


TABLE: Mapping[Role, Mapping[State, Moves]] = {
    Role.BROKER: {
        State.START: {frames.Hello: State.GREETED, frames.Error: State.CLOSED},
        State.GREETED: {frames.Error: State.CLOSED},
        **_open(FROM_CLIENT),
    },
    Role.CLIENT: {
        State.START: {frames.Error: State.CLOSED},
        State.GREETED: {frames.Welcome: State.OPEN, frames.Error: State.CLOSED},
        **_open(FROM_BROKER),
    },
}
"""The frames that each role accepts from the other, by state, with the state that follows."""

SENT: Mapping[Role, Mapping[tuple[State, FrameType], State]] = {
    Role.BROKER: {
        (State.GREETED, frames.Welcome): State.OPEN,
        (State.OPEN, frames.Goodbye): State.CLOSING,
    },
    Role.CLIENT: {
        (State.START, frames.Hello): State.GREETED,
        (State.OPEN, frames.Goodbye): State.CLOSING,
    },
}
"""The sent frames that change the sender's own state. A sent ERROR always leads to CLOSED."""

_SENT_KINDS: Final = frozenset(kind for moves in SENT.values() for _, kind in moves)


class Session:
    """One end's state of one session.

    Attributes:
        role: Which end this is.
        state: The current state.
    """

    __slots__ = ("_moves", "role", "state")

    def __init__(self, role: Role) -> None:
        self.role = role
        self._enter(State.START)

    def _enter(self, state: State) -> None:
        self.state = state
        self._moves = TABLE[self.role][state]

    @property
    def is_open(self) -> bool:
        """Whether the handshake is complete and the session is not closed."""
        return self.state is State.OPEN or self.state is State.CLOSING

    def received(self, frame: Frame) -> None:
        """Apply a frame from the peer to the state.

        Raises:
            ProtocolError: The state does not allow it.
        """
        # One lookup for each frame of an open session: the table of the current state is kept in `_moves`.
        state = self._moves.get(type(frame))
        if state is not self.state:
            if state is None:
                name = type(frame).__name__.upper()
                raise ProtocolError(
                    ErrorCode.UNEXPECTED, f"{name} is not allowed in state {self.state.value}"
                )
            self._enter(state)

    def sent(self, frame: Frame) -> None:
        """Apply a session frame (HELLO, WELCOME, GOODBYE, ERROR) sent to the peer to the state."""
        # Not checked against the state: an end's own mistake is a bug, and the peer's table finds it.
        if type(frame) is frames.Error:
            self._enter(State.CLOSED)
        elif type(frame) in _SENT_KINDS:
            self._enter(SENT[self.role].get((self.state, type(frame)), self.state))


def diagram() -> str:
    """Return one Mermaid state diagram per role, with the frames that change the state."""
    lines: list[str] = []
    for role in Role:
        lines += [f"%% {role.value}", "stateDiagram-v2", "    [*] --> START"]
        for state, moves in TABLE[role].items():
            for frame, target in sorted(moves.items(), key=lambda move: move[0].__name__):
                if target is not state:
                    lines.append(f"    {state.value} --> {target.value}: receives {frame.__name__.upper()}")
            for (source, frame), target in SENT[role].items():
                if source is state:
                    lines.append(f"    {source.value} --> {target.value}: sends {frame.__name__.upper()}")
        lines += ["    CLOSED --> [*]", ""]
    return "\n".join(lines)
