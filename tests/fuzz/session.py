"""The receiving half of a session: the same frames and the same error, however the bytes are cut."""

from __future__ import annotations

from typing import Final

from proto import limits
from proto.errors import ProtocolError
from proto.wire import frames
from proto.wire.codec import Decoder, encode
from proto.wire.fragments import Reassembler
from proto.wire.receiver import SCRATCH_BYTES, Receiver
from proto.wire.session import Role, Session
from tests.fuzz.source import Source
from tests.hostile.generate import HELLO

MAX_PIECES: Final = 200

_scratch = memoryview(bytearray(SCRATCH_BYTES))
_decoder = Decoder()


def check(data: bytes) -> None:
    """Receive bytes at once and in pieces, in a session that is open or not."""
    source = Source(data)
    options = source.below(4)
    cuts = Source(source.take(8))
    stream = (HELLO if options & 1 else b"") + data[9:]
    role = Role.CLIENT if options & 2 else Role.BROKER
    whole = receive(role, [stream])
    pieces: list[bytes] = []
    start = 0
    while start < len(stream) and len(pieces) < MAX_PIECES:
        size = 1 + cuts.below(64)
        pieces.append(stream[start : start + size])
        start += size
    assert receive(role, [*pieces, stream[start:]]) == whole


def receive(role: Role, pieces: list[bytes]) -> list[bytes]:
    """Return the encoded frames that a session takes, and the error that ends it."""
    session = Session(role)
    receiver = Receiver(session, _scratch, _decoder, Reassembler(100_000, 150_000))
    received: list[bytes] = []
    try:
        for piece in pieces:
            rest = memoryview(piece)
            while rest:
                space = receiver.buffer()
                size = min(len(space), len(rest))
                space[:size] = rest[:size]
                rest = rest[size:]
                receiver.received(size)
                while (frame := receiver.next_frame()) is not None:
                    received.append(encode(frame))
                    if isinstance(frame, frames.Hello):
                        session.sent(frames.Welcome(limits.PROTOCOL_VERSION, {}))
    except ProtocolError as error:
        received.append(str(error).encode())
    return received
