"""From a run to messages: all at once, or the good ones among bad."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from actors.endpoints.subscription.decoding import INVALID_STEPS, RENEWAL_SEC, Decoder
from actors.interfaces.codec import codec_for
from actors.interfaces.decode_budget import LEAST_SPARE_BYTES, MAX_STEPS, SPARE_BYTES, default_bytes
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.logging.logger import Logger, get_logger
from proto.queues.batches import BatchBuilder
from tests.hostile.decode_bytes import EMPTY_MAP, starved

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


def test_a_message_that_leaves_out_too_much_is_dropped(caplog: pytest.LogCaptureFixture) -> None:
    """Case 62: it is counted, one line says why, and the next one arrives."""
    # Time stands still: by the machine's clock a pause of a second between two of them lets two lines pass.
    decoder = Decoder(codec_for(TFMessage), "/tf", Logger("drops", monotonic=lambda: 0.0), lambda: 0.0)
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            assert decoder.decode(batch_of(starved("transforms", 100_000))) == ([], [])
    assert decoder.failed == 3
    assert [record.message for record in caplog.records if "'/tf'" in record.message]
    assert len(caplog.records) == 1
    message = TFMessage(transforms=[TransformStamped()] * 1000)
    decoded, _ = decoder.decode(batch_of(codec_for(TFMessage).encode(message)))
    assert decoded == [message]


def test_small_messages_in_one_batch_share_an_allowance() -> None:
    """Case 62: 8,000 messages of one byte, or as many that may have a small sequence."""
    odometry = Decoder(codec_for(Odometry), "/t", get_logger("budget"))
    decoded, _ = odometry.decode(batch_of(*[EMPTY_MAP] * 8000))
    assert len(decoded) * default_bytes(Odometry) < 2 * SPARE_BYTES
    assert odometry.failed == 8000 - len(decoded)
    transforms = Decoder(codec_for(TFMessage), "/t", get_logger("budget"))
    decoded, _ = transforms.decode(batch_of(*[starved("transforms", 100)] * 1000))
    made = sum(len(message.transforms) for message in decoded)
    assert SPARE_BYTES / 4 < made * default_bytes(TransformStamped) < 2 * SPARE_BYTES


def test_messages_that_wait_share_an_allowance() -> None:
    """Case 62: many of them take little more than one; small and full ones still arrive."""
    now = 0.0
    decoder = Decoder(codec_for(TFMessage), "/t", get_logger("budget"), lambda: now)
    made = 0
    for _ in range(20):
        now += 1.0
        decoded, _ = decoder.decode(batch_of(starved("transforms", 5000)), idle=False)
        made += sum(len(message.transforms) for message in decoded)
    assert 5000 <= made < 4 * SPARE_BYTES / default_bytes(TransformStamped)
    small = batch_of(starved("transforms", LEAST_SPARE_BYTES // default_bytes(TransformStamped) // 2))
    full = batch_of(codec_for(TFMessage).encode(TFMessage(transforms=[TransformStamped()] * 1000)))
    for batch in (small, full):
        assert len(decoder.decode(batch, idle=False)[0]) == 1
    now += 1.0
    assert len(decoder.decode(batch_of(starved("transforms", 5000)), idle=True)[0]) == 1


def test_each_message_of_a_batch_may_leave_out_a_little() -> None:
    """A busy reader takes from one batch what it takes from batches of one message."""
    now = 0.0
    decoder = Decoder(codec_for(TFMessage), "/t", get_logger("budget"), lambda: now)
    for _ in range(200):
        now += 1.0
        decoder.decode(batch_of(starved("transforms", 100)), idle=False)
    small = starved("transforms", LEAST_SPARE_BYTES // default_bytes(TransformStamped) // 2)
    now += 1.0
    decoded, _ = decoder.decode(batch_of(*[small] * 50), idle=False)
    assert len(decoded) == 50


def test_an_allowance_is_renewed_in_time() -> None:
    """Case 62: not by each quick callback, or the messages of one loop turn could use it many times."""
    now = 0.0
    decoder = Decoder(codec_for(TFMessage), "/t", get_logger("budget"), lambda: now)
    batch = batch_of(starved("transforms", 8000))
    decoder.decode(batch)
    for _ in range(2):
        now += RENEWAL_SEC
        assert [len(decoder.decode(batch)[0]) for _ in range(10)] == [1] + [0] * 9


def test_invalid_messages_take_limited_time() -> None:
    """Beyond that the rest of a batch is dropped unseen, and counted."""
    now = 0.0
    decoder = Decoder(STRINGS, "/t", get_logger("budget"), lambda: now)
    good = STRINGS.encode(String(data="good"))
    batch = batch_of(*[BAD] * (MAX_STEPS // INVALID_STEPS), good)
    assert decoder.decode(batch) == ([], [])
    assert decoder.failed == batch.length
    assert decoder.decode(batch_of(BAD, good)) == ([], [])
    now += RENEWAL_SEC
    assert decoder.decode(batch_of(BAD, good))[0] == [String(data="good")]
