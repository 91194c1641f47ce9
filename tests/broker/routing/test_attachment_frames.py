"""Pairs that are attached or detached at once cost few frames, in order with the messages around them."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import pytest

from broker.routing.attachment_frames import READERS_PER_FRAME, AttachmentFrames
from broker.routing.deliveries import Enqueue
from proto.wire import frames
from proto.wire.codec import decode
from proto.wire.codes import DetachReason
from tests.broker import frame_makers as make
from tests.broker.switch import Switch, talk

if TYPE_CHECKING:
    from broker.routing.deliveries import Delivery

PUBLISHERS = 3
READERS = 1000


def crowd(switch: Switch, readers: int = READERS) -> tuple[int, int, list[int]]:
    """Join a talker with a few publishers and a listener with many subscriptions on /t; nothing waits."""
    talker, listener = switch.join("/talker"), switch.join("/listener")
    gids = [number.to_bytes(16, "big") for number in range(PUBLISHERS)]
    numbers = [
        switch.publisher(talker, make.publisher(number, next_sequence=7)._replace(gid=gid))
        for number, gid in enumerate(gids, 1)
    ]
    switch.send(listener, *(make.subscription(number) for number in range(1, readers + 1)))
    switch.read_all(talker)
    switch.read_all(listener)
    return talker, listener, numbers


def named(read: list[frames.Attached] | list[frames.Detached]) -> Counter[tuple[int, int]]:
    """Return how often each pair of publisher and subscription is named."""
    return Counter((frame.publisher, reader) for frame in read for reader in frame.subscriptions)


@pytest.mark.parametrize("readers", [READERS, READERS_PER_FRAME + 1])
def test_a_reader_of_many_is_suspended_and_back_in_few_frames(readers: int) -> None:
    """One frame for each publisher, or one for each READERS_PER_FRAME pairs; every pair is named once."""
    switch = Switch()
    _, listener, numbers = crowd(switch, readers)
    pairs = Counter((number, reader) for number in numbers for reader in range(1, readers + 1))
    most = PUBLISHERS * (1 + readers // READERS_PER_FRAME)
    switch.suspend(listener)
    detached = switch.read(listener, frames.Detached)
    assert len(detached) == most
    assert named(detached) == pairs
    switch.restore(listener)
    attached = switch.read(listener, frames.Attached)
    assert len(attached) == most
    assert named(attached) == pairs
    assert {frame.first_sequence for frame in attached} == {7}


def test_a_talker_is_suspended_back_and_gone_in_few_frames() -> None:
    """Each of its publishers costs one frame per event on a link with many readers."""
    switch = Switch()
    talker, listener, numbers = crowd(switch)
    pairs = Counter((number, reader) for number in numbers for reader in range(1, READERS + 1))
    sent_frames = []
    switch.suspend(talker)
    sent_frames.append(switch.read(listener, frames.Detached))
    switch.leave(talker)
    sent_frames.append(switch.read(listener, frames.Detached))
    assert [len(read) for read in sent_frames] == [PUBLISHERS, PUBLISHERS]
    assert [named(read) for read in sent_frames] == [pairs, pairs]
    assert [{frame.reason for frame in read} for read in sent_frames] == [
        {DetachReason.SUSPENDED},
        {DetachReason.GONE},
    ]


def test_a_newcomer_is_attached_to_many_readers_in_one_frame() -> None:
    """A new publisher is announced once on a link, before its first batch."""
    switch = Switch()
    talker, listener, _ = crowd(switch)
    newcomer = switch.publisher(talker, make.publisher(9)._replace(gid=b"n" * 16))
    switch.send(talker, make.batch(newcomer, 0))
    received = [
        frame for frame in switch.read_all(listener) if isinstance(frame, frames.Attached | frames.Batch)
    ]
    assert [type(frame) for frame in received] == [frames.Attached, frames.Batch]
    assert isinstance(received[0], frames.Attached)
    assert received[0].subscriptions == tuple(range(1, READERS + 1))


def test_late_joiners_of_one_frame_get_their_replays_after_it() -> None:
    """Subscriptions restored together share ATTACHED; each has its own REPLAY, and then batches follow."""
    switch = Switch()
    talker, listener, number = talk(switch, qos=make.LATCHED)
    switch.send(listener, make.subscription(2, qos=make.LATCHED), make.subscription(3))
    switch.send(talker, make.batch(number, 0, 2))
    switch.suspend(listener)
    switch.read_all(listener)
    switch.restore(listener)
    switch.send(talker, make.batch(number, 2))
    kinds = (frames.Attached, frames.Replay, frames.Batch)
    sent_frames = [frame for frame in switch.read_all(listener) if isinstance(frame, kinds)]
    assert [type(frame) for frame in sent_frames] == [
        frames.Attached,
        frames.Replay,
        frames.Replay,
        frames.Batch,
    ]
    attached = sent_frames[0]
    assert isinstance(attached, frames.Attached)
    assert (attached.subscriptions, attached.first_sequence) == ((1, 2, 3), 2)
    assert [frame.subscription for frame in sent_frames if isinstance(frame, frames.Replay)] == [1, 2]


@pytest.mark.parametrize("comes_first", [False, True])
def test_attachments_and_detachments_keep_their_order(*, comes_first: bool) -> None:
    """If a pair is detached and attached again before the flush, the last event counts."""
    switch = Switch()
    _, _, number = talk(switch)
    publisher = next(each for each in switch.router.routes.publishers.values() if each.key == number)
    (route,) = publisher.routes.values()
    (subscription,) = route.subscriptions.values()
    sent_frames: list[Delivery] = []
    attachments = AttachmentFrames(sent_frames.append)

    def goes() -> None:
        attachments.detach(number, route.peer.id, [subscription.id], DetachReason.GONE, route.queue)

    def comes() -> None:
        attachments.attach(publisher, route, subscription)

    for note in (comes, goes, goes, comes) if comes_first else (goes, comes, comes, goes):
        note()
    attachments.flush()
    items = [delivery.item for delivery in sent_frames if isinstance(delivery, Enqueue)]
    frames_told = [type(decode(item)) for item in items if isinstance(item, bytes)]
    came, went = frames.Attached, frames.Detached
    assert frames_told == ([came, went, came] if comes_first else [went, came, went])
    assert not attachments.pending


def test_readers_with_different_first_numbers_get_separate_frames() -> None:
    """Messages that a publisher sends again are for latched readers only."""
    switch = Switch()
    talker, listener = switch.join("/talker"), switch.join("/listener")
    switch.send(listener, *(make.subscription(n, qos=make.LATCHED if n % 2 else None) for n in range(1, 5)))
    declaration = make.publisher(1, qos=make.LATCHED, next_sequence=5)._replace(live_sequence=9)
    switch.publisher(talker, declaration)
    attached = switch.read(listener, frames.Attached)
    assert {frame.first_sequence: frame.subscriptions for frame in attached} == {5: (1, 3), 9: (2, 4)}
