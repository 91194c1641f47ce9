"""The codec: any bytes are a frame, which survives encoding, or a ProtocolError; nothing of them is kept."""

from __future__ import annotations

from typing import Final

from proto import limits
from proto.errors import ProtocolError
from proto.wire import frames
from proto.wire.codec import Decoder, decode, encode

PROBE: Final = encode(frames.Request(1, (frames.RequestEntry(2, None, {"x": 1}, b"body"),)))

_decoder = Decoder()


def check(data: bytes) -> None:
    """Decode bytes as a whole frame, and as the content of one."""
    for raw in (data, b"\xc6" + len(data).to_bytes(4, "big") + data):
        try:
            frame = _decoder.decode(raw)
        except ProtocolError as error:
            assert len(str(error)) <= limits.MAX_ERROR_TEXT  # noqa: PT017 - this is no test
        else:
            again = encode(frame)
            assert encode(decode(again)) == again
        assert encode(_decoder.decode(PROBE)) == PROBE
