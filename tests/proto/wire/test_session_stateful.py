"""Both ends of a session under any frames, in any order, split anywhere: they take what the table says."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Any, cast

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from proto.aio.channel import Channel
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.session import TABLE, Role, State

if TYPE_CHECKING:
    from proto.wire.frames import Frame

OTHER = {Role.CLIENT: Role.BROKER, Role.BROKER: Role.CLIENT}

SAMPLES: tuple[Frame, ...] = (
    frames.Hello(1, {}),
    frames.Welcome(1, {}),
    frames.Error(1, "no"),
    frames.Goodbye("bye"),
    frames.Ping(7),
    frames.Pong(7),
    frames.Node(1, "/n"),
    frames.Undeclare(1),
    frames.Accepted(1, 0),
    frames.Cancel(1, (2,)),
    frames.Credit(1, None, None),
    frames.Refused(1, 1, "no"),
    frames.Abort(3),
)
USUAL = {Role.CLIENT: frames.Hello(1, {}), Role.BROKER: frames.Welcome(1, {})}


class Wire(asyncio.Transport):
    """Where a channel's bytes go: they wait until somebody carries them on."""

    def __init__(self) -> None:
        super().__init__()
        self.waiting = bytearray()
        self.closing = False

    def write(self, data: Any) -> None:
        if not self.closing:
            self.waiting += data

    def is_closing(self) -> bool:
        return self.closing

    def close(self) -> None:
        self.closing = True

    abort = close

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        pass


class Timer:
    """A loop that runs what is due soon at once, when asked, and nothing that is due later."""

    def __init__(self) -> None:
        self.soon: deque[Any] = deque()

    def call_soon(self, callback: Any) -> None:
        self.soon.append(callback)

    def call_later(self, delay: float, callback: Any) -> Timer:
        return self

    def cancel(self) -> None:
        pass


class End:
    """One end: a channel, what it has taken, and the model of what it should have taken."""

    def __init__(self, role: Role) -> None:
        self.role = role
        self.wire, self.loop = Wire(), Timer()
        self.channel = Channel(role, self, loop=cast("Any", self.loop))
        self.taken: list[Frame] = []
        self.failure: ProtocolError | None = None
        self.channel.connection_made(self.wire)
        self.state = State.START
        self.right: list[Frame] = []
        self.refused = False

    def opened(self) -> None:
        pass

    def frame_received(self, frame: Frame) -> None:
        self.taken.append(frame)

    def read_finished(self) -> None:
        pass

    def writable(self) -> None:
        pass

    def failed(self, error: ProtocolError) -> None:
        self.failure = error

    def closed(self, error: Exception | None) -> None:
        pass

    def run(self) -> None:
        """Do what is due."""
        while self.loop.soon:
            self.loop.soon.popleft()()

    def expect(self, frame: Frame) -> None:
        """The model takes a frame that has come."""
        if self.refused or self.state is State.CLOSED:
            return
        state = TABLE[self.role][self.state].get(type(frame))
        if state is None:
            self.refused, self.state = True, State.CLOSED
            return
        self.state = state
        if not isinstance(frame, frames.Ping | frames.Abort):
            self.right.append(frame)

    def has_sent(self, frame: Frame) -> None:
        """The model sends a frame."""
        moves = {
            (Role.CLIENT, State.START, frames.Hello): State.GREETED,
            (Role.BROKER, State.GREETED, frames.Welcome): State.OPEN,
            (Role.CLIENT, State.OPEN, frames.Goodbye): State.CLOSING,
            (Role.BROKER, State.OPEN, frames.Goodbye): State.CLOSING,
        }
        self.state = moves.get((self.role, self.state, type(frame)), self.state)


class Sessions(RuleBasedStateMachine):
    """A client and a broker that say anything; their bytes arrive late and in pieces."""

    def __init__(self) -> None:
        super().__init__()
        self.ends = {role: End(role) for role in Role}
        self.unread = {role: bytearray() for role in Role}
        """By receiver, bytes of a frame that has not come whole."""

    @rule(role=st.sampled_from(Role), frame=st.sampled_from(SAMPLES))
    def say(self, role: Role, frame: Frame) -> None:
        end = self.ends[role]
        if not end.channel.connected:
            return
        if isinstance(frame, frames.Error):
            end.channel.fail(ProtocolError(ErrorCode.UNEXPECTED, frame.text))
            end.refused, end.state = True, State.CLOSED
        else:
            end.channel.send(frame)
            end.has_sent(frame)

    @rule()
    def shake_hands(self) -> None:
        for role in (Role.CLIENT, Role.BROKER):
            self.say(role, USUAL[role])
            self.carry(OTHER[role], 10_000)

    @rule(role=st.sampled_from(Role), size=st.integers(1, 60))
    def carry(self, role: Role, size: int) -> None:
        """Some bytes arrive at an end."""
        sender, end = self.ends[OTHER[role]], self.ends[role]
        sender.run()
        piece = bytes(sender.wire.waiting[:size])
        del sender.wire.waiting[:size]
        self._expect(role, piece)
        if not piece or not end.channel.connected:
            return
        buffer = end.channel.get_buffer(-1)
        buffer[: len(piece)] = piece
        end.channel.buffer_updated(len(piece))
        end.run()

    def _expect(self, role: Role, piece: bytes) -> None:
        unread = self.unread[role]
        unread += piece
        while len(unread) >= 5 and len(unread) >= (size := 5 + int.from_bytes(unread[1:5], "big")):
            self.ends[role].expect(decode(bytes(unread[:size])))
            del unread[:size]

    @invariant()
    def each_end_is_where_the_table_says(self) -> None:
        for end in self.ends.values():
            assert end.taken == end.right
            assert end.channel.session.state is end.state
            assert (end.failure is not None) == end.refused
            if end.failure is not None:
                assert end.failure.code is ErrorCode.UNEXPECTED
            assert end.channel.connected == (end.state is not State.CLOSED)

    @invariant()
    def what_waits_is_frames(self) -> None:
        for role, end in self.ends.items():
            end.run()
            waiting = self.unread[OTHER[role]] + end.wire.waiting
            while waiting:
                size = 5 + int.from_bytes(waiting[1:5], "big")
                frame = decode(bytes(waiting[:size]))
                assert encode(frame) == waiting[:size]
                del waiting[:size]


TestSessions = Sessions.TestCase
