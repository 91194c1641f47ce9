"""The session table: every role, state and frame, and that the two ends agree."""

from __future__ import annotations

from typing import Any, cast, get_args

import pytest

from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.frames import Frame
from proto.wire.session import FROM_BROKER, FROM_CLIENT, SENT, TABLE, FrameType, Role, Session, State, diagram
from tests.seams.protocol import session_in

ALL: tuple[FrameType, ...] = get_args(Frame)
OTHER = {Role.CLIENT: Role.BROKER, Role.BROKER: Role.CLIENT}
ALLOWED = {Role.BROKER: FROM_CLIENT, Role.CLIENT: FROM_BROKER}
SESSION_FRAMES = {frames.Hello, frames.Welcome, frames.Goodbye, frames.Error}


def sample(frame: FrameType) -> Frame:
    """Make a frame of this class; its fields do not matter here."""
    fields = cast("Any", frame)._fields
    return cast("Frame", cast("Any", frame)._make([None] * len(fields)))


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("role", Role)
def test_every_frame_in_every_state(role: Role, state: State) -> None:
    """§4: a frame in the table moves the session to the state it names; any other is UNEXPECTED."""
    for frame in ALL:
        session = session_in(role, state)
        target = TABLE[role][state].get(frame)
        if target is not None:
            session.received(sample(frame))
            assert session.state is target
            continue
        with pytest.raises(
            ProtocolError, match=f"{frame.__name__.upper()} is not allowed in state"
        ) as caught:
            session.received(sample(frame))
        assert caught.value.code is ErrorCode.UNEXPECTED
        assert session.state is state


@pytest.mark.parametrize("role", Role)
def test_what_the_table_must_say(role: Role) -> None:
    """§4: before OPEN only the handshake and ERROR; then what the other end may send; nothing once CLOSED."""
    table = TABLE[role]
    assert set(table) == set(State)
    assert set(table[State.START]) | set(table[State.GREETED]) <= SESSION_FRAMES - {frames.Goodbye}
    for state in (State.OPEN, State.CLOSING):
        assert set(table[state]) == ALLOWED[role] | {frames.Goodbye, frames.Error}
    assert not table[State.CLOSED]
    for state in State:
        assert state is State.CLOSED or table[state][frames.Error] is State.CLOSED


def test_every_frame_has_a_sender() -> None:
    """§8: each frame may be sent by at least one end in some state."""
    assert set(ALL) == FROM_BROKER | FROM_CLIENT | SESSION_FRAMES
    assert not SESSION_FRAMES & (FROM_BROKER | FROM_CLIENT)


@pytest.mark.parametrize("role", Role)
def test_what_one_end_may_send_the_other_takes(role: Role) -> None:
    """§4: each move by sending has its counterpart in the other end's table."""
    states = {frames.Hello: State.START, frames.Welcome: State.GREETED, frames.Goodbye: State.OPEN}
    for (_, frame), target in SENT[role].items():
        assert TABLE[OTHER[role]][states[frame]][frame] is target


def exchange(*moves: tuple[Role, Frame]) -> tuple[State, State]:
    """Let both ends apply frames sent in turn; return the client's and the broker's state."""
    ends = {role: Session(role) for role in Role}
    for sender, frame in moves:
        ends[sender].sent(frame)
        ends[OTHER[sender]].received(frame)
    return ends[Role.CLIENT].state, ends[Role.BROKER].state


HELLO = (Role.CLIENT, frames.Hello(1, {}))
WELCOME = (Role.BROKER, frames.Welcome(1, {}))


def test_both_ends_agree_after_the_handshake() -> None:
    """§4.1: HELLO and WELCOME open both ends."""
    assert exchange(HELLO) == (State.GREETED, State.GREETED)
    assert exchange(HELLO, WELCOME) == (State.OPEN, State.OPEN)


@pytest.mark.parametrize("sender", Role)
def test_both_ends_agree_on_the_end(sender: Role) -> None:
    """§4: GOODBYE leads both ends to CLOSING and ERROR to CLOSED, whoever sends it."""
    goodbye = (sender, frames.Goodbye(""))
    error = (sender, frames.Error(1, ""))
    assert exchange(HELLO, WELCOME, goodbye) == (State.CLOSING, State.CLOSING)
    assert exchange(HELLO, WELCOME, error) == (State.CLOSED, State.CLOSED)
    assert exchange(HELLO, WELCOME, goodbye, error) == (State.CLOSED, State.CLOSED)
    assert exchange(HELLO, error) == (State.CLOSED, State.CLOSED)
    assert exchange(error) == (State.CLOSED, State.CLOSED)


def test_goodbyes_may_cross() -> None:
    """§4: a GOODBYE that crosses the other's is taken."""
    ends = [session_in(role, State.OPEN) for role in Role]
    for end in ends:
        end.sent(frames.Goodbye(""))
    for end in ends:
        end.received(frames.Goodbye(""))
        assert end.state is State.CLOSING


def test_other_frames_do_not_move_their_sender() -> None:
    """§4: sending anything but a session frame leaves the state alone."""
    for role in Role:
        for state in State:
            for frame in set(ALL) - SESSION_FRAMES:
                session = session_in(role, state)
                session.sent(sample(frame))
                assert session.state is state


def test_open_means_after_the_handshake_and_before_the_end() -> None:
    """`is_open` holds in OPEN and CLOSING only."""
    assert {state for state in State if session_in(Role.CLIENT, state).is_open} == {State.OPEN, State.CLOSING}


def test_the_diagram_shows_every_move() -> None:
    """Each move of the table that changes the state is a line of the diagram, and there is no other."""
    arrows = [line for line in diagram().splitlines() if "-->" in line and "[*]" not in line]
    moves = [
        (state, target)
        for role in Role
        for state, table in TABLE[role].items()
        for target in table.values()
        if target is not state
    ]
    assert len(arrows) == len(moves) + sum(map(len, SENT.values()))
