"""Credit: the least over the KEEP_ALL subscriptions, unlimited without one, and held to after the echo."""

from __future__ import annotations

import pytest

from broker.routing.notices import MAX_NOTICES
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codes import DetachReason
from tests.broker import frame_makers as make
from tests.broker.switch import Switch


def publish_to(switch: Switch, *windows: int) -> tuple[int, int, list[int]]:
    """Join a publisher, and a KEEP_ALL subscription of each window; return peer, publisher id and readers."""
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    readers = []
    for position, window in enumerate(windows):
        reader = switch.join(f"/reader{position}")
        switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=window))
        readers.append(reader)
    return talker, number, readers


def limits_of(switch: Switch, peer: int) -> list[int | None]:
    """Return the sequence limits that have been sent to a publisher since the last call."""
    return [credit.sequence_limit for credit in switch.read(peer, frames.Credit)]


def test_the_slowest_reader_sets_the_limit() -> None:
    """Each new subscription may lower it; a grant raises it only where it was the least."""
    switch = Switch()
    talker, number, (quick, slow) = publish_to(switch, 100, 10)
    assert limits_of(switch, talker) == [100, 10]
    switch.send(quick, frames.Grant(1, number, 500, 2**31))
    assert limits_of(switch, talker) == []
    switch.send(slow, frames.Grant(1, number, 50, 2**31))
    assert limits_of(switch, talker) == [50]


def test_a_grant_never_lowers() -> None:
    """An old grant that comes late changes nothing."""
    switch = Switch()
    talker, number, (reader,) = publish_to(switch, 10)
    switch.read_all(talker)
    switch.send(
        reader, frames.Grant(1, number, 5, 0), frames.Grant(1, 999, 50, 0), frames.Grant(9, number, 50, 0)
    )
    assert limits_of(switch, talker) == []


def test_without_keep_all_readers_it_is_unlimited_again() -> None:
    """When the last such subscription leaves, the publisher gets an unlimited CREDIT."""
    switch = Switch()
    talker, _, (reader, other) = publish_to(switch, 10, 20)
    switch.read_all(talker)
    switch.leave(reader)
    assert limits_of(switch, talker) == [20]
    switch.send(other, frames.Undeclare(1))
    assert limits_of(switch, talker) == [None]


def test_a_suspended_readers_credit_does_not_count() -> None:
    """A frozen subscriber holds no publisher back."""
    switch = Switch()
    talker, _, (reader,) = publish_to(switch, 10)
    switch.read_all(talker)
    switch.suspend(reader)
    assert limits_of(switch, talker) == [None]


def test_before_the_echo_an_overrun_is_forgiven_and_after_it_not() -> None:
    """Batches that crossed the CREDIT are allowed; after the echo the limit holds."""
    switch = Switch()
    talker, number, _ = publish_to(switch, 10)
    (credit,) = switch.read(talker, frames.Credit)
    switch.send(talker, make.batch(number, 0, 12))
    switch.send(talker, credit)
    with pytest.raises(ProtocolError) as caught:
        switch.send(talker, make.batch(number, 12))
    assert caught.value.code is ErrorCode.CREDIT


def test_up_to_the_limit_is_allowed() -> None:
    """The last message below the limit passes, the next one does not."""
    switch = Switch()
    talker, number, _ = publish_to(switch, 10)
    (credit,) = switch.read(talker, frames.Credit)
    switch.send(talker, credit, make.batch(number, 0, 10))
    with pytest.raises(ProtocolError):
        switch.send(talker, make.batch(number, 10))


def test_the_byte_limit_allows_one_message_over() -> None:
    """The message that crosses the limit may be sent, but none after it."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=1000, window_bytes=25))
    (credit,) = switch.read(talker, frames.Credit)
    assert credit.byte_limit == 25
    switch.send(talker, credit, make.batch(number, 0, 3, size=10))
    with pytest.raises(ProtocolError) as caught:
        switch.send(talker, make.batch(number, 3))
    assert caught.value.code is ErrorCode.CREDIT


def test_byte_grants_count_from_the_attachment() -> None:
    """The broker adds the bytes sent before the subscription was attached."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    switch.send(talker, make.batch(number, 0, 5, size=10))
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window_bytes=100))
    assert [credit.byte_limit for credit in switch.read(talker, frames.Credit)] == [150]
    switch.send(reader, frames.Grant(1, number, 200, 300))
    assert [credit.byte_limit for credit in switch.read(talker, frames.Credit)] == [350]


def test_only_the_latest_echo_counts() -> None:
    """After limited, unlimited, limited, the echo of the first CREDIT does not yet bind the publisher."""
    switch = Switch()
    talker, number, (reader,) = publish_to(switch, 10)
    (first,) = switch.read(talker, frames.Credit)
    switch.send(reader, frames.Undeclare(1))
    switch.send(reader, make.subscription(2, qos=make.KEEP_ALL, window=20))
    switch.send(talker, first)
    # Sent while the publisher took itself for unlimited: it had not read the last CREDIT.
    switch.send(talker, make.batch(number, 0, 30))
    last = switch.read(talker, frames.Credit)[-1]
    assert last.sequence_limit == 20


def test_limits_fit_into_a_frame() -> None:
    """Whatever windows and grants are asked for, the limit fits into its frame and holds."""
    switch = Switch()
    talker, number, _ = publish_to(switch)
    switch.send(talker, make.batch(number, 5))
    greedy, modest = switch.join("/greedy"), switch.join("/modest")
    wish = make.subscription(1, qos=make.KEEP_ALL, window=limits.MAX_U64, window_bytes=limits.MAX_U64)
    switch.send(greedy, wish, frames.Grant(1, number, limits.MAX_U64, limits.MAX_U64))
    assert switch.read(talker, frames.Credit) == [frames.Credit(number, limits.MAX_U64, limits.MAX_U64)]
    switch.send(talker, frames.Credit(number, limits.MAX_U64, limits.MAX_U64))
    switch.leave(greedy)
    switch.send(modest, make.subscription(1, qos=make.KEEP_ALL, window=2))
    sent_frames = switch.read(talker, frames.Credit)
    assert [credit.sequence_limit for credit in sent_frames] == [None, 8]
    switch.send(talker, sent_frames[-1])
    switch.send(talker, make.batch(number, 6, 2))
    with pytest.raises(ProtocolError, match="beyond its credit"):
        switch.send(talker, make.batch(number, 8))


def test_a_publisher_cannot_exceed_the_greatest_number() -> None:
    """It may declare any next number, but a batch must leave a number for the next."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL, next_sequence=limits.MAX_U64 - 1))
    with pytest.raises(ProtocolError) as caught:
        switch.send(talker, make.batch(number, limits.MAX_U64 - 1, 2))
    assert caught.value.code == ErrorCode.MALFORMED
    switch.send(talker, make.batch(number, limits.MAX_U64 - 1))
    with pytest.raises(ProtocolError):
        switch.send(talker, make.batch(number, limits.MAX_U64))
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL))
    assert [frame.first_sequence for frame in switch.read(reader, frames.Attached)] == [limits.MAX_U64]
    switch.hold()
    assert limits_of(switch, talker) == [limits.MAX_U64] * 2


@pytest.mark.parametrize("windows", [(), (100,)])
def test_a_held_publisher_stays_held_while_it_is_silent(windows: tuple[int, ...]) -> None:
    """Restored after suspension, it still may not send."""
    switch = Switch()
    talker, number, _ = publish_to(switch, *windows)
    switch.send(talker, make.batch(number, 0, 3))
    switch.hold()
    switch.suspend(talker)
    switch.restore(talker)
    assert limits_of(switch, talker)[-1:] == [3]
    switch.suspend(talker)
    switch.restore(talker)
    assert limits_of(switch, talker) == []


def test_a_publisher_that_comes_while_the_broker_stops_is_held_at_once() -> None:
    """It may send nothing, although its reader sets no limit; it keeps to that, or its link ends."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1))
    switch.hold()
    switch.send(talker, make.publisher(1, next_sequence=7))
    received = switch.read_all(talker)
    (number,) = [frame.number for frame in received if isinstance(frame, frames.Accepted)]
    credits_ = [frame for frame in received if isinstance(frame, frames.Credit)]
    assert credits_[-1] == frames.Credit(number, 7, 0)
    switch.send(talker, *credits_)
    with pytest.raises(ProtocolError) as caught:
        switch.send(talker, make.batch(number, 7))
    assert caught.value.code is ErrorCode.CREDIT


def test_nothing_is_dropped_for_a_keep_all_reader() -> None:
    """However full the link is, messages within the credit wait."""
    switch = Switch()
    talker, number, (reader,) = publish_to(switch, 100)
    switch.send(talker, *(make.batch(number, first, 10) for first in range(0, 100, 10)))
    switch.congest(reader)
    assert sum(batch.length for batch in switch.read(reader, frames.Batch)) == 100


def test_credit_begins_with_the_first_message_for_the_subscription() -> None:
    """§6.6.4: latched messages that are sent again use up no credit of a VOLATILE subscription."""
    switch = Switch()
    talker = switch.join("/talker")
    both = {**make.LATCHED, **make.KEEP_ALL}
    switch.publisher(talker, make.publisher(1, qos=both, next_sequence=3, live_sequence=8))
    reader = switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=both, window=100))
    switch.read_all(talker)
    switch.send(reader, make.subscription(2, qos=make.KEEP_ALL, window=10))
    assert limits_of(switch, talker) == [18]
    switch.send(reader, make.subscription(3, qos=both, window=10))
    assert limits_of(switch, talker) == [13]


def test_a_keep_all_reader_does_not_hold_back_a_keep_last_publisher() -> None:
    """Case 44: the publisher has unlimited credit; what a reader grants no credit for, its depth bounds."""
    switch = Switch()
    talker, reader, bystander = switch.join("/talker"), switch.join("/reader"), switch.join("/bystander")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=3))
    switch.send(bystander, make.subscription(1, qos={"depth": 1000}))
    number = switch.publisher(talker, make.publisher(1, qos={"depth": 5}))
    switch.send(talker, make.batch(number, 0, 4))
    assert spans(switch, reader) == [(0, 3)]
    for first in range(4, 40, 2):
        switch.send(talker, make.batch(number, first, 2))
        switch.congest(reader)
    assert limits_of(switch, talker) == []
    assert spans(switch, bystander)[-1] == (38, 2)
    assert spans(switch, reader) == []
    tally, _ = switch.router.routes.tallies()
    assert (tally.queued, tally.dropped) == (5, 32)
    switch.send(reader, frames.Grant(1, number, 100, 2**30))
    assert spans(switch, reader) == [(35, 1), (36, 2), (38, 2)]


def test_messages_within_a_readers_credit_wait_beyond_a_publishers_depth() -> None:
    """A KEEP_ALL reader loses nothing for which it has granted credit, however full its link is."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=30))
    number = switch.publisher(talker, make.publisher(1, qos={"depth": 5}))
    for first in range(40):
        switch.send(talker, make.batch(number, first))
        switch.congest(reader)
    tally, _ = switch.router.routes.tallies()
    assert (tally.queued, tally.dropped) == (35, 5)


def test_messages_wait_no_longer_beyond_the_depth_when_the_reader_that_granted_them_leaves() -> None:
    """Its link has another subscription, whose depth bounds them from then on."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=30))
    switch.send(reader, make.subscription(2, qos={"depth": 5}))
    number = switch.publisher(talker, make.publisher(1, qos={"depth": 5}))
    for first in range(20):
        switch.send(talker, make.batch(number, first))
        switch.congest(reader)
    switch.send(reader, frames.Undeclare(1))
    switch.congest(reader)
    tally, _ = switch.router.routes.tallies()
    assert (tally.queued, tally.dropped) == (5, 15)


@pytest.mark.parametrize("leaves", [True, False])
def test_what_waits_for_a_readers_credit_is_sent_when_it_can_grant_no_more(*, leaves: bool) -> None:
    """A KEEP_LAST publisher that leaves, and a broker that stops, let go of the messages they hold back."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=0))
    number = switch.publisher(talker, make.publisher(1, qos={"depth": 5}))
    switch.send(talker, make.batch(number, 0, 4))
    assert spans(switch, reader) == []
    if leaves:
        switch.leave(talker)
    else:
        switch.hold()
    read = switch.read_all(reader)
    assert [frame.length for frame in read if isinstance(frame, frames.Batch)] == [4]
    assert isinstance(read[-1], frames.Detached) == leaves


def test_what_is_queued_before_an_attachment_needs_none_of_its_credit() -> None:
    """A publisher comes back and sends latched messages again, while they wait for the link from before."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1))
    switch.send(talker, make.batch(switch.publisher(talker, make.publisher(1, qos=make.LATCHED)), 0, 4))
    switch.leave(talker)
    again = switch.join("/talker")
    number = switch.publisher(again, make.publisher(1, qos=make.LATCHED, next_sequence=2))
    switch.send(reader, make.subscription(2, qos=make.KEEP_ALL, window=0))
    switch.send(again, make.batch(number, 2, 2))
    read = switch.read_all(reader)
    attached = [
        number for frame in read if isinstance(frame, frames.Attached) for number in frame.subscriptions
    ]
    assert attached == [1, 1, 2]
    first = next(frame for frame in read if isinstance(frame, frames.Batch))
    assert (first.first_sequence, first.length) == (0, 4)


def test_byte_credit_of_a_keep_last_publisher_counts_from_the_attachment() -> None:
    """A large message that is being sent when a KEEP_ALL subscription joins uses none of its credit."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1))
    number = switch.publisher(talker, make.publisher(1, qos={"depth": 5}))
    switch.send(talker, make.batch(number, 0, 1, size=1_000_000))
    switch.read_all(reader, pieces=4)
    switch.send(reader, make.subscription(2, qos=make.KEEP_ALL, window=10, window_bytes=100))
    switch.send(talker, make.batch(number, 1), make.batch(number, 2))
    assert spans(switch, reader) == [(0, 1), (1, 1), (2, 1)]


def spans(switch: Switch, peer: int) -> list[tuple[int, int]]:
    """Return the first numbers and lengths of the batches that wait for a peer."""
    return [(batch.first_sequence, batch.length) for batch in switch.read(peer, frames.Batch)]


def test_a_stalled_reader_keeps_a_limited_number_of_queues() -> None:
    """What waits for it from publishers that wait no longer is limited as if the publishers were gone."""
    switch = Switch(Router(limits=RouterLimits(max_departed_queues=2)))
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=1))
    for each in range(1, 6):
        declared = make.publisher(each, qos=make.KEEP_ALL)._replace(gid=each.to_bytes(16, "big"))
        switch.send(talker, make.batch(switch.publisher(talker, declared), 0))
    switch.check_stalls(0.0, 61.0)
    tally, _ = switch.router.routes.tallies()
    assert (tally.queued, tally.dropped) == (2, 3)


def test_a_grant_after_a_stall_attaches_the_reader_at_once() -> None:
    """§6.5.9: ATTACHED is part of what the GRANT itself causes; it waits for no report and no message."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=1))
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    switch.send(talker, make.batch(number, 0))
    switch.check_stalls(0.0, 61.0)
    switch.send(talker, make.batch(number, 1))
    assert spans(switch, reader) == [(0, 1)]
    switch.carry(switch.router.handle(reader, frames.Grant(1, number, 1, 0)))
    (attached,) = switch.read(reader, frames.Attached)
    assert (attached.publisher, attached.first_sequence) == (number, 2)
    switch.send(talker, make.batch(number, 2))
    assert spans(switch, reader) == [(2, 1)]


@pytest.mark.parametrize("silent", [True, False])
def test_a_stalled_reader_learns_whether_a_publisher_may_come_back(*, silent: bool) -> None:
    """It is detached like every other reader: as of a suspended publisher, or of one that is gone."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=1))
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    switch.send(talker, make.batch(number, 0))
    switch.check_stalls(0.0, 61.0)
    if silent:
        switch.suspend(talker)
    else:
        switch.leave(talker)
    (detached,) = switch.read(reader, frames.Detached)
    assert detached.reason == (DetachReason.SUSPENDED if silent else DetachReason.GONE)


def test_many_stalls_are_few_notices_and_one_credit() -> None:
    """Case 44: a publisher of 100 stalled readers gets a limited number of NOTICEs, and one CREDIT."""
    switch = Switch()
    talker, reader = switch.join("/talker"), switch.join("/reader")
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    for each in range(1, 101):
        switch.send(reader, make.subscription(each, qos=make.KEEP_ALL, window=1 + each // 60))
    switch.send(talker, make.batch(number, 0), make.batch(number, 1))
    switch.read_all(talker)
    for now in (0.0, 61.0):
        lines, deliveries = switch.router.check_stalls(now)
        switch.carry(deliveries)
    assert len(lines) == 100
    answers = switch.read_all(talker)
    notices = [frame for frame in answers if isinstance(frame, frames.Notice)]
    assert len(notices) == MAX_NOTICES + 1
    assert notices[-1].peers == 100 - MAX_NOTICES
    assert [notice.peers for notice in switch.read(reader, frames.Notice)] == [1] * 100
    assert sum(isinstance(frame, frames.Credit) for frame in answers) == 1
