"""The session as a table: in which state which frame may come or go, and what state follows.

Both roles are here, so that the two ends cannot disagree. `TABLE` is the truth; docs/protocol.md shows the
diagram that `diagram()` makes from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import TypeAlias

from proto import frames
from proto.errors import ErrorCode, ProtocolError
from proto.frames import Frame


class Role(Enum):
    """Which end of the link this is."""

    CLIENT = "client"
    BROKER = "broker"


class State(Enum):
    """Where a session stands."""

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
)
FROM_CLIENT: frozenset[FrameType] = _EITHER | {
    frames.Node,
    frames.Publisher,
    frames.Subscription,
    frames.Service,
    frames.Client,
    frames.Undeclare,
    frames.Retire,
    frames.Grant,
    frames.Watch,
    frames.Unwatch,
    frames.Describe,
    frames.Inspect,
}
"""What a client may send in an open session."""

FROM_BROKER: frozenset[FrameType] = _EITHER | {
    frames.Accepted,
    frames.Refused,
    frames.Matched,
    frames.Attached,
    frames.Detached,
    frames.Notice,
    frames.Replay,
    frames.Graph,
    frames.Definition,
    frames.Stats,
}
"""What a broker may send in an open session."""


def _open(received: frozenset[FrameType]) -> Mapping[State, Moves]:
    stay = dict.fromkeys(received, State.OPEN)
    linger = dict.fromkeys(received, State.CLOSING)
    ends: Moves = {frames.Goodbye: State.CLOSING, frames.Error: State.CLOSED}
    return {State.OPEN: {**stay, **ends}, State.CLOSING: {**linger, **ends}, State.CLOSED: {}}


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
"""What each role accepts from the other, by state."""

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
"""The frames whose sending moves the sender's own state. An ERROR that is sent always ends in CLOSED."""


class Session:
    """One end's view of one session. Pure: bytes and clocks are elsewhere."""

    __slots__ = ("_moves", "role", "state")

    def __init__(self, role: Role) -> None:
        self.role = role
        self._enter(State.START)

    def _enter(self, state: State) -> None:
        self.state = state
        self._moves = TABLE[self.role][state]

    @property
    def is_open(self) -> bool:
        """Whether the handshake is over and neither side has closed."""
        return self.state is State.OPEN or self.state is State.CLOSING

    def received(self, frame: Frame) -> None:
        """Take note of a frame from the peer.

        Raises:
            ProtocolError: The state does not allow it.
        """
        state = self._moves.get(type(frame))
        if state is not self.state:
            if state is None:
                name = type(frame).__name__.upper()
                raise ProtocolError(
                    ErrorCode.UNEXPECTED, f"{name} is not allowed in state {self.state.value}"
                )
            self._enter(state)

    def sent(self, frame: Frame) -> None:
        """Take note of a session frame (HELLO, WELCOME, GOODBYE, ERROR) that goes to the peer."""
        if type(frame) is frames.Error:
            self._enter(State.CLOSED)
            return
        state = SENT[self.role].get((self.state, type(frame)))
        if state is not None:
            self._enter(state)


def diagram() -> str:
    """Return the table as a Mermaid state diagram, one per role; open-session frames are summed up."""
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
