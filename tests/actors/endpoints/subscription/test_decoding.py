"""From a run to messages: all at once, or the good ones among bad."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from actors.endpoints.subscription.decoding import Decoder
from actors.interfaces.codec import codec_for
from actors.interfaces.std_msgs.msg import String
from actors.logging.logger import get_logger
from proto.queues.batches import BatchBuilder

if TYPE_CHECKING:
    import pytest

    from proto.wire.frames import Batch

STRINGS = codec_for(String)
BAD = b"\xc0"


def batch_of(*encoded: bytes) -> Batch:
    """Return a run whose first message has the number 5."""
    builder = BatchBuilder(5)
    for message in encoded:
        builder.add(message)
    return builder.build(1, 0)


def test_a_good_run_is_decoded_with_its_numbers() -> None:
    """Every message, and the number of each."""
    decoder = Decoder(STRINGS, "/t", get_logger("n"))
    batch = batch_of(*(STRINGS.encode(String(data=text)) for text in "abc"))
    decoded, numbers = decoder.decode(batch)
    assert decoded == [String(data=text) for text in "abc"]
    assert list(numbers) == [5, 6, 7]
    assert decoder.failed == 0


def test_bad_messages_are_left_out_and_counted(caplog: pytest.LogCaptureFixture) -> None:
    """The good ones keep their numbers; the log names the topic."""
    decoder = Decoder(STRINGS, "/t", get_logger("n"))
    good = STRINGS.encode(String(data="good"))
    with caplog.at_level(logging.WARNING):
        decoded, numbers = decoder.decode(batch_of(BAD, good, BAD, good))
    assert decoded == [String(data="good")] * 2
    assert list(numbers) == [6, 8]
    assert decoder.failed == 2
    assert "'/t'" in caplog.text


def test_without_a_codec_messages_are_bytes() -> None:
    """Raw subscriptions take whatever comes."""
    decoded, numbers = Decoder(None, "/t", get_logger("n")).decode(batch_of(BAD, b"\x01"))
    assert (decoded, list(numbers)) == ([BAD, b"\x01"], [5, 6])
