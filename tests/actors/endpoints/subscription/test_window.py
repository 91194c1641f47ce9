"""Windows: little to begin with, more for those whose messages are taken, less for each of many."""

from __future__ import annotations

import pytest

from actors.endpoints.subscription.credit import (
    LEAST_BYTES,
    LEAST_MESSAGES,
    SHARED_BYTES,
    WINDOW_BYTES,
    WINDOW_MESSAGES,
    CreditWindows,
)
from actors.session.attachments import Attachment
from proto.limits import MAX_U64
from proto.wire.codec import encode
from proto.wire.frames import Attached, Grant


class Nobody:
    """A reader that is not looked at."""


def attachment(first: int = 10) -> Attachment:
    """Return a publisher's runs from a number on."""
    return Attachment(Nobody(), Attached(1, (1,), b"g" * 16, first, "/talker", {}))  # type: ignore[arg-type]


def test_one_publisher_is_granted_a_whole_window_at_once() -> None:
    """It begins with nothing."""
    windows, flow = CreditWindows(), attachment()
    windows.attached(flow)
    assert (flow.granted_sequence, flow.granted_bytes) == (10, 0)
    windows.divide(1)
    assert windows.open(flow)
    assert (flow.granted_sequence, flow.granted_bytes) == (10 + WINDOW_MESSAGES, WINDOW_BYTES)


def test_one_of_very_many_is_granted_the_least_there_is() -> None:
    """A window never gets too small for a good run."""
    windows, flow = CreditWindows(), attachment()
    windows.attached(flow)
    windows.divide(10_000)
    assert windows.open(flow)
    assert (flow.granted_sequence, flow.granted_bytes) == (10 + LEAST_MESSAGES, LEAST_BYTES)


def test_a_grant_waits_until_half_is_used() -> None:
    """Credit costs a frame for each half of a window, not for each run."""
    windows, flow = CreditWindows(), attachment(0)
    windows.divide(1)
    windows.open(flow)
    ends = range(1, 2 * WINDOW_MESSAGES)
    grants = [windows.consumed(flow, end, 1) and windows.open(flow) for end in ends]
    assert sum(grants) == pytest.approx(4, abs=1)


@pytest.mark.parametrize("publishers", [1, 4, 5, 100, 10_000])
def test_many_publishers_share(publishers: int) -> None:
    """Together they have the shared bytes, or the least that each has."""
    windows = CreditWindows()
    windows.divide(publishers)
    assert windows.bytes * publishers <= max(SHARED_BYTES, publishers * LEAST_BYTES)
    assert LEAST_BYTES <= windows.bytes <= WINDOW_BYTES
    assert LEAST_MESSAGES <= windows.messages <= WINDOW_MESSAGES


def test_a_grant_is_never_taken_back() -> None:
    """When publishers come, those that have large windows keep them until they are used up."""
    windows, flow = CreditWindows(), attachment(0)
    windows.open(flow)
    granted = flow.granted_sequence, flow.granted_bytes
    windows.divide(1000)
    assert not windows.consumed(flow, 2, 1)
    assert (flow.granted_sequence, flow.granted_bytes) == granted


def test_a_grant_fits_its_frame_whatever_the_publishers_numbers_are() -> None:
    """Near the end of 64 bits the limit is the greatest number there is."""
    windows, flow = CreditWindows(), attachment(MAX_U64 - 5)
    windows.attached(flow)
    windows.open(flow)
    assert flow.granted_sequence <= MAX_U64
    encode(Grant(1, 1, flow.granted_sequence, flow.granted_bytes))
