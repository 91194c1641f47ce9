"""Topics in the router: matching, attachment, depth, suspension, replay, and every refusal."""

from __future__ import annotations

import msgpack
import pytest

from broker.routing.deliveries import Discard, Enqueue
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import decode
from proto.wire.codes import DetachReason, NoticeKind, Op, PolicyKind
from proto.wire.identity import public_gid
from tests.broker import frame_makers as make
from tests.broker.switch import Switch, talk


def test_a_batch_arrives_byte_for_byte_after_its_attachment() -> None:
    """The link gets ATTACHED, then the frame as it was sent."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(7))
    number = switch.publisher(talker, make.publisher(3, next_sequence=40))
    sent = make.batch(number, 40, 3)
    switch.send(talker, sent)
    received = switch.read_all(listener)
    assert frames.Matched(7, 1, 1) in received
    ordered = [frame for frame in received if isinstance(frame, (frames.Attached, frames.Batch))]
    gid = public_gid(b"t" * 16, make.GID)
    assert ordered[0] == frames.Attached(number, (7,), gid, 40, "/talker", make.QOS)
    assert isinstance(ordered[1], frames.Batch)
    assert bytes(ordered[1].raw) == bytes(sent.raw)


def test_a_link_with_many_subscriptions_gets_a_batch_once() -> None:
    """Fan-out inside a process is the node's: the broker sends one copy to each link."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1), make.subscription(2, raw=True))
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, make.batch(number, 0))
    assert len(switch.read(listener, frames.Batch)) == 1
    assert switch.router.routes.copies == 1


def test_publishers_that_nobody_reads_are_left_out_of_regular_checks() -> None:
    """Case 66: a hundred thousand of another broker would hold the loop at each of them."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    matched = switch.router.topics.matched
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, make.publisher(2, "/unread"))
    assert list(matched) == []
    switch.send(listener, make.subscription(7), make.subscription(8))
    assert list(matched) == [number]
    switch.send(listener, frames.Undeclare(7))
    assert list(matched) == [number]
    switch.send(listener, frames.Undeclare(8))
    assert list(matched) == []
    switch.send(listener, make.subscription(9))
    assert list(matched) == [number]
    switch.send(talker, frames.Undeclare(1))
    assert list(matched) == []


def test_messages_without_a_subscription_count_as_unmatched() -> None:
    """They are counted, not kept."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, make.batch(number, 0, 5))
    assert switch.router.routes.unmatched == 5
    assert switch.router.routes.copies == 0


def test_seen_messages_are_discarded_and_gaps_are_allowed() -> None:
    """An old batch is discarded, a partly old one is cut; a gap is a loss of the publisher."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, make.batch(number, 0, 4), make.batch(number, 0, 4), make.batch(number, 2, 4))
    switch.send(talker, make.batch(number, 9, 1))
    received = switch.read(listener, frames.Batch)
    assert [(batch.first_sequence, batch.length) for batch in received] == [(0, 4), (4, 2), (9, 1)]
    assert switch.router.routes.stale == 6


def test_a_busy_link_keeps_the_greatest_depth_of_its_subscriptions() -> None:
    """Only a full transport drops, the oldest first, and each drop is counted."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, qos={"depth": 2}), make.subscription(2, qos={"depth": 5}))
    number = switch.publisher(talker, make.publisher(1))
    switch.send(talker, *(make.batch(number, first, 2) for first in range(0, 20, 2)))
    switch.congest(listener)
    received = switch.read(listener, frames.Batch)
    assert sum(batch.length for batch in received) == 5
    assert received[-1].first_sequence + received[-1].length == 20
    assert switch.router.routes.tallies()[0].dropped == 15


def test_the_depth_shrinks_when_the_deeper_subscription_leaves() -> None:
    """The queue keeps no more than the remaining subscription asks for."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, qos={"depth": 2}), make.subscription(2, qos={"depth": 5}))
    number = switch.publisher(talker, make.publisher(1))
    switch.send(listener, frames.Undeclare(2))
    switch.send(talker, make.batch(number, 0, 9))
    switch.congest(listener)
    assert sum(batch.length for batch in switch.read(listener, frames.Batch)) == 2


def test_detached_comes_after_the_last_batch() -> None:
    """The subscription then has no counterpart any more."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, make.batch(number, 0, 2), frames.Undeclare(1))
    received = switch.read_all(listener)
    ordered = [type(frame) for frame in received if not isinstance(frame, frames.Matched)]
    assert ordered == [frames.Batch, frames.Detached]
    assert frames.Matched(1, 0, 1) in received


def test_a_node_takes_its_endpoints_along() -> None:
    """UNDECLARE of a node removes what it declared, and frees its name."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, frames.Undeclare(0))
    assert switch.read(listener, frames.Detached) == [frames.Detached(number, (1,), 0)]
    switch.send(talker, frames.Node(9, "/talker"))
    assert switch.read(talker, frames.Accepted) == [frames.Accepted(9, 0)]
    with pytest.raises(ProtocolError) as caught:
        switch.send(talker, make.batch(number, 0))
    assert caught.value.code is ErrorCode.UNKNOWN_ID


def test_types_that_differ_do_not_match_and_are_reported() -> None:
    """Another hash on the same topic is no match; each endpoint gets one notice."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1))
    number = switch.publisher(talker, make.publisher(2, type_hash="RIHS01_bb"))
    switch.send(talker, make.batch(number, 0))
    received = switch.read_all(listener)
    notices = [frame for frame in received if isinstance(frame, frames.Notice)]
    assert [(notice.id, notice.kind) for notice in notices] == [(1, NoticeKind.INCOMPATIBLE_TYPE)]
    assert "/talker" in notices[0].text
    assert "/listener" in notices[0].text
    assert not any(isinstance(frame, frames.Batch) for frame in received)


def test_a_raw_subscription_matches_every_type() -> None:
    """Without a type there is nothing to disagree about."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, raw=True))
    number = switch.publisher(talker, make.publisher(2, type_hash="RIHS01_bb"))
    switch.send(talker, make.batch(number, 0))
    assert len(switch.read(listener, frames.Batch)) == 1


@pytest.mark.parametrize(
    ("offered", "requested", "policy"),
    [({"reliability": 2}, {}, "RELIABILITY"), ({}, {"durability": 1}, "DURABILITY")],
)
def test_a_qos_mismatch_delivers_and_warns_both(
    offered: frames.Options, requested: frames.Options, policy: str
) -> None:
    """Less than was asked for is still delivered; both endpoints hear which policy it is."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, qos=requested))
    switch.send(talker, make.publisher(2, qos=offered))
    received = switch.read_all(talker)
    number = next(frame.number for frame in received if isinstance(frame, frames.Accepted))
    switch.send(talker, make.batch(number, 0))
    notices = [frame for frame in received if isinstance(frame, frames.Notice)]
    assert [(notice.id, notice.kind) for notice in notices] == [(2, NoticeKind.INCOMPATIBLE_QOS)]
    received = switch.read_all(listener)
    notices = [frame for frame in received if isinstance(frame, frames.Notice)]
    assert [(notice.id, notice.kind) for notice in notices] == [(1, NoticeKind.INCOMPATIBLE_QOS)]
    assert policy in notices[0].text
    assert any(isinstance(frame, frames.Batch) for frame in received)


@pytest.mark.parametrize("side", ["publisher", "subscription", "both"])
@pytest.mark.parametrize("publisher_first", [False, True])
def test_a_strict_endpoint_matches_no_incompatible_one(side: str, *, publisher_first: bool) -> None:
    """One strict side suffices: no match, attachment, message or replay; both hear of it, and again later."""
    offered = {"reliability": 2, "durability": 1, "strict": side != "subscription"}
    requested = {"durability": 1, "strict": side != "publisher"}
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    if not publisher_first:
        switch.send(listener, make.subscription(1, qos=requested))
    number = switch.publisher(talker, make.publisher(2, qos=offered))
    switch.send(talker, make.batch(number, 0))
    if publisher_first:
        switch.send(listener, make.subscription(1, qos=requested))
    switch.suspend(talker)
    switch.restore(talker)
    switch.send(talker, make.batch(number, 1))
    received = switch.read_all(listener)
    assert {type(frame) for frame in received} == {frames.Accepted, frames.Notice}
    notices = [frame for frame in received if isinstance(frame, frames.Notice)]
    assert [(each.kind, each.policy) for each in notices] == [
        (NoticeKind.INCOMPATIBLE_QOS, PolicyKind.RELIABILITY)
    ] * 2
    assert "No messages will be received from it" in notices[0].text
    assert not switch.read(talker, frames.Matched)
    switch.leave(talker)
    assert not switch.read_all(listener)


def test_strict_endpoints_match_compatible_ones() -> None:
    """Among several counterparts a strict subscription matches those that offer what it requests."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(1, qos={"strict": True}))
    numbers = [switch.publisher(talker, make.publisher(n, qos={"reliability": n})) for n in (1, 2)]
    for number in numbers:
        switch.send(talker, make.batch(number, 0))
    received = switch.read_all(listener)
    assert [frame.publisher for frame in received if isinstance(frame, frames.Batch)] == numbers[:1]
    assert [frame.peers for frame in received if isinstance(frame, frames.Matched)] == [1]


def test_pairs_that_do_not_match_do_not_count_for_the_limit() -> None:
    """A strict endpoint is refused for its matches, not for its incompatible counterparts."""
    switch = Switch(Router(limits=RouterLimits(max_matches=1)))
    listener, talker = switch.join("/listener"), switch.join("/talker")
    switch.send(talker, *(make.publisher(n, qos={"reliability": 2}) for n in (1, 2)))
    switch.send(listener, make.subscription(1, qos={"strict": True}), make.subscription(2))
    answers = [
        type(each) for each in switch.read_all(listener) if isinstance(each, frames.Accepted | frames.Refused)
    ]
    assert answers == [frames.Accepted, frames.Refused]


def test_a_late_subscription_gets_the_latched_messages_then_live_ones() -> None:
    """It gets the last messages, at most its depth, in order, once, before the live batches."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1, qos={**make.LATCHED, "depth": 6}))
    switch.send(talker, make.batch(number, 0, 4), make.batch(number, 4, 4))
    switch.send(listener, make.subscription(5, qos={**make.LATCHED, "depth": 5}))
    switch.send(talker, make.batch(number, 8))
    received = switch.read_all(listener)
    queue = [frame for frame in received if isinstance(frame, (frames.Attached, frames.Replay, frames.Batch))]
    attached, *rest = queue
    assert isinstance(attached, frames.Attached)
    assert attached.first_sequence == 8
    numbers = [
        (type(frame), frame.first_sequence, frame.length)
        for frame in rest
        if isinstance(frame, (frames.Replay, frames.Batch))
    ]
    assert numbers == [(frames.Replay, 3, 1), (frames.Replay, 4, 4), (frames.Batch, 8, 1)]


def test_a_volatile_subscription_gets_no_latched_messages() -> None:
    """Old messages go only to those who asked for them."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1, qos=make.LATCHED))
    switch.send(talker, make.batch(number, 0, 4))
    switch.send(listener, make.subscription(5))
    assert switch.read(listener, frames.Replay) == []


@pytest.mark.parametrize("meanwhile", [False, True])
def test_latched_messages_sent_again_are_not_for_volatile_subscriptions(*, meanwhile: bool) -> None:
    """Whether they joined before the publisher returned or after, they get live batches only."""
    switch = Switch()
    talker = switch.join("/talker")
    keen, plain = switch.join("/keen"), switch.join("/plain")
    declaration = make.publisher(1, qos=make.LATCHED, next_sequence=3, live_sequence=8)
    if not meanwhile:
        switch.send(keen, make.subscription(5, qos=make.LATCHED))
        switch.send(plain, make.subscription(5))
    number = switch.publisher(talker, declaration)
    switch.send(talker, make.batch(number, 3, 2))
    if meanwhile:
        switch.send(keen, make.subscription(5, qos=make.LATCHED))
        switch.send(plain, make.subscription(5))
    keen_first = switch.read(keen, frames.Attached)[0].first_sequence
    assert keen_first == (5 if meanwhile else 3)
    assert switch.read(plain, frames.Attached)[0].first_sequence == 8


def test_a_publisher_that_does_not_say_what_is_live_has_only_live_messages() -> None:
    """§4.1.4: a client from before `live_sequence` sends nine fields; readers of every kind hear it."""
    old = make.publisher(1, qos=make.LATCHED, next_sequence=3)[:9]
    declaration = decode(_framed(msgpack.packb((Op.PUBLISHER, *old))))
    assert isinstance(declaration, frames.Publisher)
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, make.subscription(5), make.subscription(6, qos=make.LATCHED))
    number = switch.publisher(talker, declaration)
    switch.send(talker, make.batch(number, 3, 2))
    attached, batch = switch.read_all(listener)[-2:]
    assert isinstance(attached, frames.Attached)
    assert (attached.first_sequence, attached.subscriptions) == (3, (5, 6))
    assert isinstance(batch, frames.Batch)


def _framed(content: bytes) -> bytes:
    return b"\xc6" + len(content).to_bytes(4, "big") + content


def test_messages_of_a_publisher_that_has_sent_its_latched_ones_again_are_live() -> None:
    """After them a volatile subscription is attached at the present, like any other."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    declaration = make.publisher(1, qos=make.LATCHED, next_sequence=3, live_sequence=8)
    number = switch.publisher(talker, declaration)
    switch.send(talker, make.batch(number, 3, 5), make.batch(number, 8, 2))
    switch.send(listener, make.subscription(5))
    assert switch.read(listener, frames.Attached)[0].first_sequence == 10


@pytest.mark.parametrize("publisher_first", [False, True])
@pytest.mark.parametrize("topics", [1, 3])
def test_on_a_suspended_link_the_last_detached_says_gone(topics: int, *, publisher_first: bool) -> None:
    """§4.3.4: a link that subscribes to itself gets GONE, in any order of declarations; then ATTACHED."""
    switch = Switch()
    peer = switch.join("/both")
    numbers: set[int] = set()

    def publishes(index: int) -> None:
        declaration = make.publisher(index + 1, f"/t{index}")._replace(gid=bytes([index]) * 16)
        numbers.add(switch.publisher(peer, declaration))

    def subscribes(index: int) -> None:
        switch.send(peer, make.subscription(index + 101, f"/t{index}"))

    for declare in (publishes, subscribes) if publisher_first else (subscribes, publishes):
        for index in range(topics):
            declare(index)
    switch.read_all(peer)
    switch.suspend(peer)
    last = {frame.publisher: frame.reason for frame in switch.read(peer, frames.Detached)}
    assert last == dict.fromkeys(numbers, DetachReason.GONE)
    switch.restore(peer)
    assert {frame.publisher for frame in switch.read(peer, frames.Attached)} == numbers


def test_a_suspended_subscriber_leaves_and_comes_back_at_the_present() -> None:
    """While suspended it is not matched; restored, it is attached from the next message on."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.suspend(listener)
    assert switch.read(talker, frames.Matched) == [frames.Matched(1, 0, 1)]
    switch.send(talker, make.batch(number, 0, 5))
    assert switch.router.routes.unmatched == 5
    switch.restore(listener)
    switch.send(talker, make.batch(number, 5))
    attached, received = None, []
    for frame in switch.read_all(listener):
        attached = frame if isinstance(frame, frames.Attached) else attached
        received += [frame.first_sequence] if isinstance(frame, frames.Batch) else []
    assert attached is not None
    assert attached.first_sequence == 5
    assert received == [5]


def test_a_suspended_publisher_is_detached_and_its_latched_messages_stay() -> None:
    """Its readers see it go; who joins meanwhile gets the latched messages when it is back."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1, qos=make.LATCHED))
    switch.send(talker, make.batch(number, 0, 3))
    switch.suspend(talker)
    switch.send(listener, make.subscription(1, qos=make.LATCHED))
    assert switch.read(listener, frames.Attached) == []
    switch.restore(talker)
    assert [replay.length for replay in switch.read(listener, frames.Replay)] == [3]


@pytest.mark.parametrize(
    "declaration",
    [
        frames.Node(5, ""),
        frames.Node(5, "/a b"),
        frames.Node(5, "/ns//x"),
        frames.Node(5, "/1x"),
        frames.Node(5, "/" + "x" * 300),
        make.publisher(5, "chatter"),
        make.publisher(5, "/a/*"),
        make.subscription(5, "/" + "/".join("x" * 300)),
        make.subscription(5, "/\x1b[31m"),
        make.service(5, "/s/"),
        make.client(5, ""),
    ],
)
def test_an_invalid_name_is_refused(declaration: frames.Frame) -> None:
    """Relative, empty, too long, wildcard and control-character names never get in, and do no harm."""
    switch = Switch()
    peer = switch.join("/n")
    switch.send(peer, declaration, frames.Undeclare(5))
    refused = switch.read(peer, frames.Refused)
    assert [(answer.id, answer.code) for answer in refused] == [(5, ErrorCode.INVALID_NAME)]
    assert "\x1b" not in refused[0].text


@pytest.mark.parametrize("name", ["foo", "//foo"])
def test_a_node_name_is_its_one_full_form(name: str) -> None:
    """Another spelling of `/foo` would be a second node of that name."""
    switch = Switch()
    peer = switch.join("/foo")
    switch.send(peer, frames.Node(5, name))
    assert [answer.code for answer in switch.read(peer, frames.Refused)] == [ErrorCode.INVALID_NAME]


@pytest.mark.parametrize(
    "qos",
    [
        {"history": 3},
        {"depth": -1},
        {"depth": "x"},
        {"depth": True},
        {"reliability": 0},
        {"durability": None},
    ],
)
def test_an_impossible_qos_is_refused(qos: frames.Options) -> None:
    """Values that mean nothing are refused as malformed."""
    switch = Switch()
    peer = switch.join("/n")
    switch.send(peer, make.publisher(5, qos=qos))
    assert [answer.code for answer in switch.read(peer, frames.Refused)] == [ErrorCode.MALFORMED]


def test_an_unknown_node_and_the_limit_are_refused() -> None:
    """Endpoints need a node of this link, and a link may declare only so many."""
    switch = Switch(Router(limits=RouterLimits(max_endpoints=2)))
    peer = switch.join("/n")
    switch.send(peer, make.publisher(5, node=77), make.publisher(6), make.publisher(7))
    refused = switch.read(peer, frames.Refused)
    assert [(answer.id, answer.code) for answer in refused] == [
        (5, ErrorCode.UNKNOWN_ID),
        (7, ErrorCode.LIMIT),
    ]


def test_a_live_id_cannot_be_declared_again() -> None:
    """A reused id is a protocol error, not a second endpoint."""
    switch = Switch()
    peer = switch.join("/n")
    with pytest.raises(ProtocolError) as caught:
        switch.send(peer, make.publisher(0))
    assert caught.value.code is ErrorCode.UNEXPECTED


def test_nobody_publishes_under_another_links_id() -> None:
    """A forged publisher id closes the forger and reaches nobody."""
    switch = Switch()
    _, listener, number = talk(switch)
    forger = switch.join("/forger")
    with pytest.raises(ProtocolError) as caught:
        switch.send(forger, make.batch(number, 0))
    assert caught.value.code is ErrorCode.UNKNOWN_ID
    assert switch.read(listener, frames.Batch) == []


def test_the_same_instance_with_its_token_takes_over() -> None:
    """The old link is closed, its endpoints are gone, its name is free for the new one."""
    switch = Switch()
    identity = b"i" * 16
    old = switch.join("/robot", instance=identity)
    new = switch.join("/robot", instance=identity)
    assert switch.closed == {old: ErrorCode.TAKEN_OVER}
    assert new != old


def test_a_guessed_instance_without_the_token_takes_nothing() -> None:
    """A stranger with a stolen instance id is refused the name, and the holder stays."""
    switch = Switch()
    identity = b"i" * 16
    switch.join("/robot", instance=identity)
    stranger = switch.join(instance=identity, token=b"x" * 16)
    switch.send(stranger, frames.Node(0, "/robot"))
    assert [answer.code for answer in switch.read(stranger, frames.Refused)] == [ErrorCode.NAME_TAKEN]
    assert switch.closed == {}
    assert switch.join("/robot", instance=identity) != stranger


def test_ids_in_a_detachment_fit_one_header() -> None:
    """A link with more subscriptions on one topic than a header array holds can still read its DETACHED."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    number = switch.publisher(talker, make.publisher(1))
    count = limits.MAX_HEADER_ARRAY + 1
    switch.send(listener, *(make.subscription(n) for n in range(1, count + 1)))
    switch.read_all(listener)
    switch.leave(talker)
    detached = switch.read(listener, frames.Detached)
    assert {frame.publisher for frame in detached} == {number}
    assert sum(len(frame.subscriptions) for frame in detached) == count


def test_a_link_that_leaves_leaves_nothing() -> None:
    """When all links have left, the graph is empty and no queue is left."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, make.batch(number, 0, 4), make.client(8), make.service(9))
    switch.leave(listener)
    switch.leave(talker)
    assert len(switch.router.graph) == 0
    tally = switch.router.routes.tallies()[0]
    assert (tally.queued, tally.leaving) == (0, 0)
    assert switch.router.calls.pending == 0


def test_readers_of_a_suspended_publisher_learn_how_that_ends() -> None:
    """DETACHED says that it is silent; attached anew it is back; another DETACHED says that it is gone."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.suspend(talker)
    assert switch.read(listener, frames.Detached) == [frames.Detached(number, (1,), DetachReason.SUSPENDED)]
    switch.restore(talker)
    assert [frame.publisher for frame in switch.read(listener, frames.Attached)] == [number]
    assert [notice.kind for notice in switch.read(talker, frames.Notice)] == [NoticeKind.SUSPENDED]
    switch.suspend(talker)
    switch.leave(talker)
    reasons = [frame.reason for frame in switch.read(listener, frames.Detached)]
    assert reasons == [DetachReason.SUSPENDED, DetachReason.GONE]


def test_a_reader_that_is_suspended_as_well_learns_how_that_ends() -> None:
    """It gets DETACHED with GONE; if the publisher is restored first, it is attached to it as usual."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.suspend(talker)
    switch.suspend(listener)
    reasons = [frame.reason for frame in switch.read(listener, frames.Detached)]
    assert reasons == [DetachReason.SUSPENDED, DetachReason.GONE]
    switch.restore(talker)
    switch.restore(listener)
    assert [frame.publisher for frame in switch.read(listener, frames.Attached)] == [number]
    switch.suspend(talker)
    switch.read_all(listener)
    switch.leave(talker)
    assert [frame.reason for frame in switch.read(listener, frames.Detached)] == [DetachReason.GONE]


def test_a_suspended_reader_is_detached_from_earlier_ids_as_well() -> None:
    """The queue that a publisher resumed is discarded, with the DETACHED of the earlier id in it."""
    switch = Switch()
    talker, listener, first = talk(switch)
    lives = [first]
    for life in range(3):
        switch.send(talker, make.batch(lives[-1], 3 * life, 3))
        switch.leave(talker)
        talker = switch.join("/talker")
        lives.append(switch.publisher(talker, make.publisher(1, next_sequence=3 * life + 3)))
    switch.suspend(listener)
    detached = switch.read(listener, frames.Detached)
    assert [(frame.publisher, frame.reason) for frame in detached] == [
        (life, DetachReason.GONE) for life in lives
    ]


def test_only_readers_that_knew_a_publisher_learn_that_it_is_gone() -> None:
    """Not those that joined after its suspension, nor those that have left."""
    switch = Switch()
    talker, listener, _ = talk(switch)
    switch.suspend(talker)
    newcomer = switch.join("/newcomer")
    switch.send(newcomer, make.subscription(1))
    switch.send(listener, frames.Undeclare(1), make.subscription(2))
    switch.read_all(listener)
    switch.leave(talker)
    assert switch.read(newcomer, frames.Detached) == []
    assert switch.read(listener, frames.Detached) == []


def test_the_end_of_a_suspended_publisher_does_not_overtake_its_batches() -> None:
    """Its messages are read before DETACHED with GONE."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, make.batch(number, 0, 3))
    switch.suspend(talker)
    switch.leave(talker)
    order = [
        frame for frame in switch.read_all(listener) if isinstance(frame, (frames.Batch, frames.Detached))
    ]
    assert isinstance(order[0], frames.Batch)
    assert [frame.reason for frame in order[1:] if isinstance(frame, frames.Detached)] == [1, 0]


def test_an_assertion_reaches_the_readers() -> None:
    """ASSERT goes to every link with a subscription; for a publisher of another link it ends the session."""
    switch = Switch()
    talker, listener, number = talk(switch)
    switch.send(talker, frames.Assert(number))
    assert switch.read(listener, frames.Assert) == [frames.Assert(number)]
    with pytest.raises(ProtocolError):
        switch.send(listener, frames.Assert(number))


def test_many_mismatches_are_summed_up_for_the_newcomer() -> None:
    """It gets 16 notices and a summary; every counterpart gets its own notice."""
    switch = Switch()
    listener = switch.join("/listener")
    switch.send(listener, *(make.subscription(n, qos={"deadline_ns": 5}) for n in range(1, 41)))
    switch.read_all(listener)
    talker = switch.join("/talker")
    switch.publisher(talker, make.publisher(1))
    sent_frames = switch.read(listener, frames.Notice)
    assert [(notice.policy, notice.peers) for notice in sent_frames] == [(PolicyKind.DEADLINE, 1)] * 40
    switch.send(talker, make.publisher(2))
    received = switch.read(talker, frames.Notice)
    assert [notice.peers for notice in received] == [1] * 16 + [24]
    assert received[-1].policy == PolicyKind.DEADLINE


def test_texts_are_cut_to_what_a_receiver_must_take() -> None:
    """However long the names in them are."""
    switch = Switch()
    talker, listener = switch.join("/" + "t" * 240), switch.join("/" + "l" * 240)
    topic = "/" + "x" * 240
    switch.publisher(talker, make.publisher(1, topic, type_hash="RIHS01_bb"))
    switch.send(listener, make.subscription(1, topic))
    for peer in (talker, listener):
        assert [len(notice.text) for notice in switch.read(peer, frames.Notice)] == [limits.MAX_ERROR_TEXT]


def test_frames_from_its_own_publisher_to_a_link_that_is_taken_over_are_discarded() -> None:
    """Its queues are discarded last."""
    switch = Switch()
    peer = switch.join("/both", instance=b"i" * 16)
    number = switch.publisher(peer, make.publisher(1))
    switch.send(peer, make.subscription(2), make.batch(number, 0))
    _, deliveries = switch.router.connect(b"i" * 16, b"t" * 16)
    of_queues = [delivery for delivery in deliveries if isinstance(delivery, Enqueue | Discard)]
    assert [type(delivery) for delivery in of_queues] == [Enqueue, Discard]
