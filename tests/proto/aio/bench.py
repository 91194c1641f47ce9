"""A channel with a fake transport and a fake loop."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from proto import limits
from proto.aio.budgeted_channel import BudgetedChannel
from proto.aio.channel import Channel
from proto.wire import frames
from proto.wire.codec import decode
from proto.wire.fragments import Reassembler
from proto.wire.session import Role, State
from tests.seams.protocol import enter

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.aio.read_budget import ReadBudget
    from proto.errors import ProtocolError
    from proto.wire.frames import Frame


class FakeLoop:
    """A loop whose time and scheduled calls the test controls."""

    def __init__(self) -> None:
        self.now = 0.0
        self.soon: list[Callable[[], object]] = []
        self.later: list[FakeTimer] = []

    def time(self) -> float:
        return self.now

    def call_soon(self, callback: Callable[[], object]) -> None:
        self.soon.append(callback)

    def call_later(self, delay: float, callback: Callable[[], object]) -> FakeTimer:
        self.later.append(FakeTimer(delay, callback))
        return self.later[-1]

    def turn(self) -> None:
        """Run what has been scheduled so far."""
        due, self.soon = self.soon, []
        for callback in due:
            callback()


class FakeTimer:
    """A timer that the test may fire."""

    def __init__(self, delay: float, callback: Callable[[], object]) -> None:
        self.delay = delay
        self.callback = callback
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


class FakeTransport(asyncio.Transport):
    """Records what is written; full after `space` bytes, which it reports within `write` as asyncio does."""

    def __init__(self, space: int | None = None) -> None:
        super().__init__()
        self.written: list[bytes] = []
        self.lists: list[list[bytes]] = []
        self.reading = True
        self.space = space
        self.channel: Channel | None = None
        self.closing = False
        self.aborted = False

    def write(self, data: bytes | bytearray | memoryview[Any]) -> None:
        assert not self.closing, "a write into a closing transport is lost"
        self.written.append(bytes(data))
        if self.space is not None and self.channel is not None and not self.channel.busy:
            self.space -= len(data)
            if self.space <= 0:
                self.channel.pause_writing()

    def writelines(self, list_of_data: Any) -> None:
        self.lists.append(list_of_data)
        self.write(b"".join(list_of_data))

    def pause_reading(self) -> None:
        self.reading = False

    def resume_reading(self) -> None:
        self.reading = True

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        assert (high, low) == (limits.HIGH_WATER_BYTES, limits.LOW_WATER_BYTES)

    def is_closing(self) -> bool:
        return self.closing

    def close(self) -> None:
        self.closing = True

    def abort(self) -> None:
        self.closing = self.aborted = True

    def sent(self) -> list[Frame]:
        """Decode and forget what has been written."""
        stream, self.written = b"".join(self.written), []
        return split(stream)


class Recorder:
    """A handler that records its calls."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.events: list[str] = []
        self.failures: list[ProtocolError] = []
        self.react: Callable[[Frame], None] = lambda frame: None

    def opened(self) -> None:
        self.events.append("opened")

    def frame_received(self, frame: Frame) -> None:
        self.frames.append(frame)
        self.react(frame)

    def read_finished(self) -> None:
        self.events.append("batch")

    def writable(self) -> None:
        self.events.append("writable")

    def failed(self, error: ProtocolError) -> None:
        self.failures.append(error)

    def closed(self, error: Exception | None) -> None:
        self.events.append("closed")


class Bench:
    """One channel with everything around it fake."""

    def __init__(
        self,
        role: Role = Role.BROKER,
        state: State = State.OPEN,
        *,
        space: int | None = None,
        most: int = 10**6,
        budget: ReadBudget | None = None,
        loop: FakeLoop | None = None,
    ) -> None:
        self.loop = loop or FakeLoop()
        self.handler = Recorder()
        on: Any = {"loop": self.loop, "reassembler": Reassembler(most)}
        self.channel = Channel(role, self.handler, **on)
        if budget is not None:
            self.channel = BudgetedChannel(role, self.handler, budget=budget, **on)
        self.transport = FakeTransport(space)
        self.transport.channel = self.channel
        self.channel.connection_made(self.transport)
        enter(self.channel.session, state)

    def feed(self, data: bytes) -> None:
        """Let the channel read these bytes, as a loop would."""
        while data and not self.transport.closing:
            buffer = self.channel.get_buffer(-1)
            assert len(buffer) > 0
            count = min(len(buffer), len(data))
            buffer[:count] = data[:count]
            self.channel.buffer_updated(count)
            data = data[count:]

    def farewell(self) -> frames.Error:
        """Return the ERROR frame that ended the connection."""
        error = self.transport.sent()[-1]
        assert isinstance(error, frames.Error)
        assert self.transport.closing
        assert self.channel.session.state is State.CLOSED
        assert not self.channel.connected
        return error


def split(stream: bytes) -> list[Frame]:
    """Decode a stream of whole frames."""
    found: list[Frame] = []
    while stream:
        stop = 5 + int.from_bytes(stream[1:5], "big")
        found.append(decode(stream[:stop]))
        stream = stream[stop:]
    return found
