"""A broker that breaks the rules is rejected, and harms nobody else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Snapshot
from proto.limits import MAX_U64
from proto.wire import frames
from proto.wire.codes import Status
from tests.broker import frame_makers as make
from tests.broker.mesh.attack import HERE, NODE, OTHER, THERE, Attack
from tests.broker.mesh.network import Network
from tests.fuzz.mesh import check
from tests.seams.brokers import endpoint_keys
from tests.seams.structure import of_router

if TYPE_CHECKING:
    from collections.abc import Callable


def _answer_for_another(attack: Attack) -> None:
    """Answer a call of broker 1 to broker 3."""
    attack.broker.send(attack.node, make.request(4, 50))
    ((request, _),) = attack.sent()
    attack.direct(make.reply(4, request.entries[0].call))
    assert attack.broker.read(attack.node, frames.Reply) == []


def _snapshot(attack: Attack, declarations: tuple[frames.Frame, ...]) -> None:
    attack.mesh.accept_heartbeat(THERE, Heartbeat(99, {HERE: (1, attack.number[THERE])}))
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 99, declarations))


def _call_twice(attack: Attack) -> None:
    attack.direct(make.request(4, 5), 3)
    attack.direct(make.request(4, 5), 3)


def _batch(key: int, first: int = 0) -> frames.Batch:
    return make.batch(key, first)


PUBLISHER = THERE << 32 | 2

ATTACKS: dict[str, Callable[[Attack], None]] = {
    "twice": lambda attack: attack.change(make.publisher(2, node=1)),
    "node-twice": lambda attack: attack.change(NODE),
    "no-node": lambda attack: attack.change(make.publisher(9, node=8)),
    "node-before-endpoints": lambda attack: attack.change(frames.Undeclare(1)),
    "snapshot-twice": lambda attack: _snapshot(attack, (NODE, frames.Node(1, "/again"))),
    "snapshot-order": lambda attack: _snapshot(attack, (make.publisher(9, node=8), frames.Node(8, "/late"))),
    "others-batch": lambda attack: attack.mesh.receive(THERE, _batch(OTHER << 32 | 9)),
    "own-batch": lambda attack: attack.mesh.receive(THERE, _batch(attack.publisher)),
    "others-assert": lambda attack: attack.mesh.receive(THERE, frames.Assert(attack.publisher)),
    "sequence-overflow": lambda attack: attack.mesh.receive(THERE, _batch(PUBLISHER, MAX_U64)),
    "others-attached": lambda attack: attack.direct(attack.attached(broker=OTHER)),
    "own-attached": lambda attack: attack.direct(attack.attached(broker=HERE)),
    "others-replay": lambda attack: attack.direct(frames.Replay(2, *_batch(OTHER << 32 | 9)[:-1])),
    "others-reply": _answer_for_another,
    "call-twice": lambda attack: attack.direct(make.request(4, 5, 5), 3),
    "call-again": _call_twice,
    "wrong-kind": lambda attack: attack.direct(frames.Undeclare(1)),
    "epoch": lambda attack: attack.mesh.receive(THERE, Direct(HERE, MAX_U64, 1, 0, attack.attached())),
    "heartbeat-epoch": lambda attack: attack.mesh.accept_heartbeat(THERE, Heartbeat(0, {HERE: (MAX_U64, 0)})),
}


@pytest.mark.parametrize("attack", ATTACKS.values(), ids=ATTACKS)
def test_a_broker_that_breaks_a_rule_is_rejected(attack: Callable[[Attack], None]) -> None:
    """Its endpoints go, the reason is logged once, and other brokers and nodes notice nothing."""
    under = Attack()
    attack(under)
    under.assert_rejected()
    under.direct(under.attached())
    under.change(frames.Node(20, "/more"))
    under.mesh.accept_heartbeat(THERE, Heartbeat(50, {}))
    under.mesh.add_broker(THERE)
    under.assert_rejected()


def test_a_rejected_broker_may_come_again_when_its_presence_has_ended() -> None:
    """Its next presence is a new beginning."""
    attack = Attack()
    attack.mesh.reject(THERE, "test")
    attack.mesh.remove_broker(THERE)
    attack.mesh.add_broker(THERE)
    (ask,) = (message for message in attack.settle() if isinstance(message, Ask))
    assert (ask.broker, ask.epoch) == (THERE, 2)


def test_a_rejected_broker_notices_that_it_is_ignored() -> None:
    """Calls of its nodes fail with the next heartbeat, and it sees nothing of the broker that ignores it."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, make.request(1, 5))
    network.settle()
    b.mesh.reject(1, "test")
    network.settle()
    assert len(b.read(server, frames.Cancel)) == 1
    for _ in range(3):
        network.beat()
    (reply,) = a.read(caller, frames.Reply)
    assert reply.entries[0].status == Status.UNAVAILABLE
    assert {key >> 32 for key in endpoint_keys(a.router)} == {1}
    assert a.mesh.resets == 1


HARMLESS: dict[str, Callable[[Attack], None]] = {
    "unknown-undeclare": lambda attack: attack.change(frames.Undeclare(1234)),
    "version-0": lambda attack: attack.mesh.receive(THERE, Change(0, frames.Node(30, "/zero"))),
    "unknown-publisher": lambda attack: attack.mesh.receive(THERE, _batch(THERE << 32 | 99)),
    "unknown-attached": lambda attack: attack.direct(attack.attached(99)),
    "unknown-grant": lambda attack: attack.direct(frames.Grant(99, attack.publisher, 5, 5)),
    "others-publisher-grant": lambda attack: attack.direct(frames.Grant(3, OTHER << 32, MAX_U64, MAX_U64)),
    "unknown-reply": lambda attack: attack.direct(make.reply(4, MAX_U64)),
    "unknown-cancel": lambda attack: attack.direct(frames.Cancel(4, (99,))),
    "no-client-cancel": lambda attack: attack.direct(frames.Cancel(99, (1,))),
    "earlier-number": lambda attack: attack.mesh.receive(THERE, Direct(HERE, 1, 0, 0, attack.attached())),
    "bad-name": lambda attack: attack.change(frames.Node(30, "no/slash"), make.client(31, node=30)),
    "bad-qos": lambda attack: attack.change(make.publisher(30, node=1, qos={"depth": -1})),
    "bad-topic": lambda attack: attack.change(make.publisher(30, "a b", node=1)),
    "node-of-endpoint": lambda attack: attack.change(make.publisher(30, node=2)),
}


@pytest.mark.parametrize("attack", HARMLESS.values(), ids=HARMLESS)
def test_what_can_be_ignored_changes_nothing(attack: Callable[[Attack], None]) -> None:
    """Unknown endpoints and numbers are no reason to reject a broker."""
    under = Attack()
    before = endpoint_keys(under.broker.router)
    attack(under)
    assert endpoint_keys(under.broker.router) == before
    assert tuple(under.mesh.sessions.names()) == (THERE, OTHER)
    assert list(of_router(under.broker.router)) == []
    under.mesh.receive(THERE, _batch(PUBLISHER))
    assert len(under.broker.read(under.node, frames.Batch)) == 1


def test_messages_under_the_key_of_another_topic_are_ignored() -> None:
    """Who may write under one key writes no messages of another topic, nor while a snapshot is awaited."""
    attack = Attack()
    attack.mesh.receive(THERE, _batch(PUBLISHER), "/other")
    attack.mesh.receive(THERE, Change(99, frames.Undeclare(50)))  # changes are missing
    attack.mesh.receive(THERE, _batch(PUBLISHER), "/other")
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 99, (NODE, make.publisher(2, node=1))))
    assert attack.broker.read(attack.node, frames.Batch) == []
    attack.mesh.receive(THERE, _batch(PUBLISHER), "/t")
    assert len(attack.broker.read(attack.node, frames.Batch)) == 1


def test_a_call_of_a_client_that_is_not_known_is_answered() -> None:
    """Its broker may have more endpoints than this one takes; its call does not hang."""
    attack = Attack()
    attack.direct(make.request(99, 7), 3)
    ((reply, _),) = attack.sent()
    assert (reply.endpoint, reply.entries[0].call, reply.entries[0].status) == (99, 7, Status.UNAVAILABLE)


def test_a_version_far_ahead_leads_to_one_request_per_heartbeat() -> None:
    """The snapshot that should have the change does not have it."""
    attack = Attack()
    attack.mesh.receive(THERE, Change(MAX_U64, frames.Node(30, "/never")))
    for _ in range(3):
        assert [type(message) for message in attack.settle()] == [Ask]
        attack.mesh.accept_snapshot(THERE, Snapshot(1, 5, ()))
        assert attack.settle() == []
        attack.mesh.accept_heartbeat(THERE, Heartbeat(5, {HERE: (1, 0)}))


def test_messages_that_wait_for_a_snapshot_have_a_limit_in_bytes() -> None:
    """A broker that never answers cannot fill the memory."""
    attack = Attack()
    attack.mesh.accept_heartbeat(THERE, Heartbeat(99, {}))
    batch = make.batch(PUBLISHER, 0, 1, 4 * 1024 * 1024)
    for _ in range(10):
        attack.mesh.receive(THERE, batch)
    assert attack.mesh.ignored == 6


def test_endpoints_of_one_broker_have_a_limit() -> None:
    """Those beyond it are refused, with what belongs to them, and logged; other brokers have their own."""
    attack = Attack(max_endpoints=6)
    attack.change(make.publisher(5, node=1), make.publisher(6, node=1), make.publisher(7, node=1))
    attack.change(
        frames.Node(8, "/more"), make.publisher(9, node=8), frames.Undeclare(9), frames.Undeclare(8)
    )
    attack.change(frames.Node(3, "/fourth"), broker=OTHER)
    keys = {key for key in endpoint_keys(attack.broker.router) if key >> 32 == THERE}
    assert {key & 0xFFFF for key in keys} == {1, 2, 3, 4, 5, 6}
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER)
    assert {what for what, *_ in attack.warnings} == {"refused an endpoint of"}
    assert attack.broker.router.refusals.count == 3
    attack.change(frames.Undeclare(6), make.publisher(10, node=1))
    assert THERE << 32 | 10 in endpoint_keys(attack.broker.router)


@pytest.mark.parametrize("name", ["unknown-publisher", "unknown-attached", "unknown-grant", "unknown-reply"])
def test_messages_about_unknown_endpoints_are_counted(name: str) -> None:
    """Each of them once."""
    attack = Attack()
    before = attack.mesh.counts()["ignored"]
    HARMLESS[name](attack)
    assert attack.mesh.counts()["ignored"] == before + 1


def test_invalid_numbers_of_brokers_are_ignored() -> None:
    """Also this broker's own, which another must not use."""
    attack = Attack()
    for number in (0, HERE, 2**32, -1):
        attack.mesh.add_broker(number)
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER)


def test_messages_of_an_unknown_broker_are_counted_and_ignored() -> None:
    """It has left, or was rejected, and does not know it yet."""
    attack = Attack()
    before = endpoint_keys(attack.broker.router)
    attack.mesh.receive(99, Change(1, frames.Node(1, "/unknown")))
    assert attack.mesh.ignored == 1
    assert endpoint_keys(attack.broker.router) == before


@given(st.binary(max_size=400))
def test_any_messages_leave_the_broker_consistent(data: bytes) -> None:
    """Other brokers send anything in any order: nothing is raised, and all tables agree."""
    check(data)


def test_a_message_that_comes_twice_is_received_once() -> None:
    """The number of the last one is an earlier number, too."""
    attack = Attack()
    attack.direct(make.request(4, 5), 3)
    attack.mesh.receive(THERE, Direct(HERE, 1, attack.number[THERE], 3, make.request(4, 6)))
    assert len(attack.broker.read(attack.node, frames.Request)) == 1
    assert attack.mesh.ignored == 1
