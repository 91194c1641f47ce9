"""Brokers that announce themselves and do not answer, that have or change too much, or break the rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from broker.mesh import broker_session, mesh, slices, standing, wire
from broker.mesh.messages import Ask, Change, Heartbeat, Snapshot
from proto.wire import frames
from proto.wire.codec import encode
from tests.broker import frame_makers as make
from tests.broker.mesh.attack import HERE, NODE, OTHER, THERE, Attack
from tests.broker.mesh.network import MeshBroker
from tests.seams.brokers import endpoint_keys

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

FAKE = 1000
"""The first number of brokers that do not answer."""


def asked(attack: Attack) -> list[int]:
    """Return which brokers are asked for their snapshots."""
    brokers: list[int] = []
    while messages := attack.settle():
        brokers += [each.broker for each in messages if isinstance(each, Ask)]
    return brokers


def fail(attack: Attack, brokers: Iterable[int]) -> None:
    """Let requests to brokers end without an answer."""
    for broker in brokers:
        attack.mesh.accept_snapshot(broker, None)


def beat(attack: Attack, times: int = 1) -> list[int]:
    """Let seconds pass in which nobody answers; return who is asked."""
    brokers: list[int] = []
    for _ in range(times):
        attack.mesh.send_heartbeat()
        while now := asked(attack):
            brokers += now
            fail(attack, now)
    return brokers


def nodes(count: int, first: int = 10) -> tuple[frames.Frame, ...]:
    """Return declarations of nodes."""
    return tuple(frames.Node(number, f"/n{number}") for number in range(first, first + count))


def finish(attack: Attack) -> int:
    """Let all work be done; return in how many slices."""
    count = 0
    while attack.mesh.work.pending:
        attack.mesh.work.go_on(10)
        count += 1
    return count


def keys_of(attack: Attack, broker: int) -> set[int]:
    """Return the numbers of a broker's endpoints at the router."""
    return {key & 0xFFFF_FFFF for key in endpoint_keys(attack.broker.router) if key >> 32 == broker}


def test_brokers_that_do_not_answer_share_one_limit_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 64: whatever they send; it is counted, and another's messages still wait for its snapshot."""
    monkeypatch.setattr(broker_session, "MAX_TOTAL_BYTES", 100_000)
    monkeypatch.setattr(broker_session, "KEPT_BYTES", 75_000)
    attack = Attack()
    attack.mesh.receive(THERE, Change(99, frames.Undeclare(50)))  # changes are missing: it is asked
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 2, 0))
    for broker in range(FAKE, FAKE + 40):
        attack.mesh.add_broker(broker)
        for number in range(10):
            attack.mesh.receive(broker, make.batch(broker << 32 | 2, number, size=10_000))
    assert attack.mesh.sessions.memory.bytes <= 100_000
    assert attack.mesh.ignored >= 390
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER)
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 99, (NODE, make.publisher(2, node=1))))
    assert len(attack.broker.read(attack.node, frames.Batch)) == 1
    for broker in range(FAKE, FAKE + 40):
        attack.mesh.remove_broker(broker)
    assert attack.mesh.sessions.memory.bytes == 0


def test_large_messages_beyond_that_limit_are_not_even_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 64: nor any of a broker that is not there; small ones are, and all of one that has answered."""
    monkeypatch.setattr(broker_session, "SMALL_BYTES", 2000)
    monkeypatch.setattr(broker_session, "KEPT_BYTES", 75_000)
    attack = Attack()
    attack.mesh.add_broker(FAKE)
    admitted = 0
    while attack.mesh.sessions.admits(FAKE, 10_000):
        attack.mesh.receive(FAKE, make.batch(FAKE << 32 | 2, admitted, size=10_000))
        admitted += 1
    assert admitted == 7
    attack.mesh.add_broker(FAKE + 1)
    assert [attack.mesh.sessions.admits(FAKE + 1, size) for size in (10_000, 2000)] == [False, True]
    assert [attack.mesh.sessions.admits(broker, 10_000) for broker in (THERE, FAKE + 2)] == [True, False]
    assert attack.mesh.counts()["ignored"] == 3


def test_a_snapshot_that_waits_counts_for_that_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 64: a broker that answers and never asks in return is asked again later."""
    monkeypatch.setattr(broker_session, "MAX_TOTAL_BYTES", 1000)
    monkeypatch.setattr(broker_session, "KEPT_BYTES", 750)
    attack = Attack()
    attack.mesh.add_broker(FAKE)
    assert asked(attack) == [FAKE]
    attack.mesh.accept_snapshot(FAKE, Snapshot(1, 1, nodes(1), size=2000))
    assert attack.mesh.sessions.memory.bytes == 0
    attack.mesh.send_heartbeat()
    assert asked(attack) == [FAKE]


def test_all_graphs_share_that_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 64: who announces brokers in many graphs costs no more, and what is small is kept."""
    monkeypatch.setattr(broker_session, "MAX_TOTAL_BYTES", 100_000)
    monkeypatch.setattr(broker_session, "KEPT_BYTES", 75_000)
    memory = broker_session.MeshMemory()
    graphs = [MeshBroker(HERE, memory).mesh for _ in range(10)]
    for graph in graphs:
        graph.add_broker(FAKE)
        for number in range(9):
            graph.receive(FAKE, make.batch(FAKE << 32 | 2, number, size=10_000))
        graph.add_broker(THERE)
        graph.receive(THERE, make.batch(THERE << 32 | 2, 0))
        assert memory.bytes <= 100_000
    sessions = [graph.sessions.get(THERE) for graph in graphs]
    assert [len(each.waiting) for each in sessions if each is not None] == [1] * 10


def test_brokers_that_do_not_answer_are_asked_less_and_less() -> None:
    """Case 65: a few times at once, as Zenoh may not know the route yet, then at growing intervals."""
    attack = Attack()
    attack.mesh.add_broker(FAKE)
    tries = asked(attack)
    fail(attack, [FAKE])
    while now := asked(attack):
        tries += now
        fail(attack, [FAKE])
    assert len(tries) == broker_session.QUICK_ASKS
    assert len(beat(attack, 10)) in range(2, 6)
    beat(attack, 100)
    assert len(beat(attack, 10 * broker_session.MAX_PAUSE)) == 10
    attack.mesh.accept_heartbeat(FAKE, Heartbeat(1, {}))
    attack.mesh.accept_heartbeat(FAKE, Heartbeat(1, {}))
    assert asked(attack) == [FAKE]  # it is there now


def test_few_of_many_brokers_that_do_not_answer_are_asked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 65: of a thousand brokers a hundred are asked; the others when a heartbeat of theirs comes."""
    monkeypatch.setattr(broker_session, "MAX_QUICKLY_ASKED", 5)
    attack = Attack()
    few, many = [*range(FAKE, FAKE + 5)], [*range(FAKE + 5, FAKE + 20)]
    for broker in (*few, *many):
        attack.mesh.add_broker(broker)
    assert asked(attack) == few
    fail(attack, few)
    assert asked(attack) == []
    assert beat(attack) == few
    attack.mesh.accept_heartbeat(many[0], Heartbeat(1, {}))
    assert asked(attack) == many[:1]
    fail(attack, many[:1])
    assert {*many[1:]} < {*beat(attack, broker_session.MAX_UNHEARD_FIRST)}


def test_who_announces_many_brokers_keeps_none_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 65: beyond the limit one that has not answered is given up until it sends a heartbeat."""
    monkeypatch.setattr(broker_session, "MAX_UNANSWERED", 5)
    attack = Attack()
    for broker in range(FAKE, FAKE + 5):
        attack.mesh.add_broker(broker)
    attack.mesh.add_broker(OTHER + 1)
    beat(attack, 3)
    for broker in range(FAKE + 10, FAKE + 40):
        attack.mesh.add_broker(broker)
        fail(attack, asked(attack))
    assert attack.mesh.limited == 31
    assert {what for what, *_ in attack.warnings} == {"gave up"}
    assert len(attack.mesh.sessions) == 2 + 5
    assert OTHER + 1 not in attack.mesh.sessions
    attack.mesh.accept_heartbeat(OTHER + 1, Heartbeat(1, {}))
    assert OTHER + 1 in asked(attack)
    attack.mesh.snapshot(OTHER + 1, 1)
    attack.mesh.accept_snapshot(OTHER + 1, Snapshot(2, 1, nodes(1)))
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER, OTHER + 1)
    assert keys_of(attack, OTHER + 1) == {10}


def test_a_broker_whose_token_was_lost_is_found_by_its_heartbeat() -> None:
    """It counts as gone when its heartbeats end, unless its token comes after all."""
    attack = Attack()
    for broker in (FAKE, FAKE + 1):
        attack.mesh.accept_heartbeat(broker, Heartbeat(1, {}))
        assert asked(attack) == [broker]
        attack.mesh.snapshot(broker, 1)
        attack.mesh.accept_snapshot(broker, Snapshot(1, 1, nodes(1, broker)))
    attack.mesh.add_broker(FAKE + 1)
    for _ in range(broker_session.MAX_SILENT):
        attack.mesh.send_heartbeat()
    attack.mesh.accept_heartbeat(FAKE, Heartbeat(1, {HERE: (1, 0)}))
    for _ in range(broker_session.MAX_SILENT):
        attack.mesh.send_heartbeat()
    assert keys_of(attack, FAKE) == {FAKE}
    attack.mesh.send_heartbeat()
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER, FAKE + 1)
    assert keys_of(attack, FAKE) == set()


@pytest.mark.parametrize("rejected", [False, True])
def test_a_broker_without_a_token_is_found_again_and_goes_again(*, rejected: bool) -> None:
    """By its next heartbeat, after it was silent or rejected; the end of its heartbeats is its end again."""
    attack = Attack()
    attack.mesh.accept_heartbeat(FAKE, Heartbeat(1, {}))
    if rejected:
        attack.mesh.reject(FAKE, "test")
    for _ in range(broker_session.MAX_SILENT + 1):
        attack.mesh.send_heartbeat()
    asked(attack)
    assert (FAKE in attack.mesh.sessions) is rejected  # its ban has ended meanwhile
    attack.mesh.accept_heartbeat(FAKE, Heartbeat(1, {}))
    assert FAKE in attack.mesh.sessions
    for _ in range(broker_session.MAX_SILENT + 1):
        attack.mesh.send_heartbeat()
    assert FAKE not in attack.mesh.sessions


def test_a_request_whose_end_is_never_told_is_made_again() -> None:
    """Whatever becomes of it in the engine."""
    attack = Attack()
    attack.mesh.add_broker(FAKE)
    assert asked(attack) == [FAKE]
    for _ in range(broker_session.MAX_UNHEARD):
        attack.mesh.send_heartbeat()
        assert asked(attack) == []
    attack.mesh.send_heartbeat()
    assert asked(attack) == [FAKE]


def test_brokers_beyond_the_limit_are_counted_and_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 65: only brokers that have answered count, and another one gets in when one of them has gone."""
    monkeypatch.setattr(broker_session, "MAX_BROKERS", 3)
    attack = Attack()
    for broker in (FAKE, FAKE + 1):
        attack.mesh.add_broker(broker)
        attack.mesh.snapshot(broker, 1)
        asked(attack)
        attack.mesh.accept_snapshot(broker, Snapshot(1, 1, nodes(1, broker)))
    assert tuple(attack.mesh.sessions.names()) == (THERE, OTHER, FAKE)
    assert attack.mesh.limited == 1
    attack.mesh.remove_broker(FAKE)
    while FAKE + 1 not in asked(attack):
        attack.mesh.send_heartbeat()
    attack.mesh.accept_snapshot(FAKE + 1, Snapshot(1, 1, nodes(1, FAKE + 1)))
    assert FAKE + 1 in attack.mesh.sessions.names()


def test_a_large_snapshot_is_imported_in_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: what comes meanwhile waits, other brokers and nodes do not, and afterwards all is there."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.mesh.receive(THERE, Change(99, frames.Undeclare(50)))
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 98, (NODE, make.publisher(2, node=1), *nodes(100))))
    assert len(keys_of(attack, THERE)) < 50
    attack.mesh.receive(THERE, Change(100, frames.Node(500, "/last")))
    attack.mesh.receive(THERE, make.batch(THERE << 32 | 2, 0))
    attack.change(frames.Node(9, "/meanwhile"), broker=OTHER)
    assert 9 in keys_of(attack, OTHER)
    assert attack.broker.read(attack.node, frames.Batch) == []
    assert finish(attack) > 10
    assert keys_of(attack, THERE) == {1, 2, 500, *range(10, 110)} - {50}
    assert len(attack.broker.read(attack.node, frames.Batch)) == 1


def test_a_large_broker_is_removed_in_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: it may be back before the last of its endpoints has gone."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.change(*nodes(100))
    attack.mesh.remove_broker(THERE)
    assert len(keys_of(attack, THERE)) > 50
    attack.mesh.add_broker(THERE)
    attack.rejoin(NODE, make.publisher(2, node=1), *nodes(100))
    attack.mesh.remove_broker(THERE)
    attack.mesh.add_broker(THERE)
    attack.mesh.snapshot(THERE, 3)
    attack.mesh.accept_snapshot(THERE, Snapshot(3, 1, (NODE, *nodes(30))))
    finish(attack)
    assert keys_of(attack, THERE) == {1, *range(10, 40)}


def test_the_numbers_of_a_large_broker_are_freed_in_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: they lie between the records, whose memory is free only with them."""

    freed: list[int] = []

    class Number(int):
        """A number whose end is seen."""

        def __del__(self) -> None:
            freed.append(int(self))

    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.rejoin(*(frames.Node(Number(value), f"/n{value}") for value in range(10, 110)))
    finish(attack)
    assert not freed
    attack.mesh.remove_broker(THERE)
    attack.mesh.work.go_on(40)
    assert len(freed) in {49, 50}
    finish(attack)
    assert len(freed) == 100


def test_a_snapshot_is_no_more_imported_when_its_broker_has_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: in the middle of it."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.mesh.receive(THERE, Change(99, frames.Undeclare(50)))
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 99, nodes(100)))
    for _ in range(12):
        attack.mesh.work.go_on(10)
    assert keys_of(attack, THERE)
    attack.mesh.remove_broker(THERE)
    finish(attack)
    assert keys_of(attack, THERE) == set()


def test_an_epoch_that_begins_during_an_import_has_a_snapshot_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Case 66: that of the earlier one counts no more, and the broker is asked for another at once."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.mesh.remove_broker(THERE)
    attack.mesh.add_broker(THERE)
    assert asked(attack) == [THERE]
    attack.mesh.snapshot(THERE, 2)
    attack.mesh.accept_snapshot(THERE, Snapshot(2, 1, nodes(100)))
    while not keys_of(attack, THERE):
        attack.mesh.work.go_on(10)
    attack.mesh.snapshot(THERE, 3)
    assert asked(attack) == [THERE]
    finish(attack)
    assert keys_of(attack, THERE) == set()
    attack.mesh.snapshot(THERE, 3)
    attack.mesh.accept_snapshot(THERE, Snapshot(3, 1, nodes(3)))
    finish(attack)
    assert keys_of(attack, THERE) == {10, 11, 12}


def test_a_snapshot_is_decoded_no_further_than_the_limit_of_endpoints() -> None:
    """Case 66: what is beyond it counts as refused, and keeps nothing out of a later snapshot within it."""
    attack = Attack(max_endpoints=6)
    decoded = 0

    class Declarations(tuple[frames.Frame, ...]):
        __slots__ = ()

        def __iter__(self) -> Iterator[frames.Frame]:
            nonlocal decoded
            for each in super().__iter__():
                decoded += 1
                yield each

    def take(version: int, declarations: tuple[frames.Frame, ...]) -> set[int]:
        attack.mesh.accept_heartbeat(THERE, Heartbeat(version, {HERE: (1, attack.number[THERE])}))
        assert asked(attack) == [THERE]
        attack.mesh.accept_snapshot(THERE, Snapshot(1, version, declarations))
        finish(attack)
        return keys_of(attack, THERE)

    assert take(50, Declarations(nodes(100))) == set(range(10, 16))
    assert decoded == 6 + 6
    assert attack.broker.router.refusals.count == attack.mesh.counts()["refused"] == 94
    assert take(51, nodes(5, first=200)) == set(range(200, 205))


def test_snapshots_that_are_imported_share_a_limit_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: what is too large beside others is asked for after them, and small ones do not wait."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    large = 2 * broker_session.MAX_TOTAL_BYTES
    for broker, size in ((FAKE, large), (FAKE + 1, 100_000), (FAKE + 2, 1000), (FAKE + 3, large)):
        attack.mesh.add_broker(broker)
        attack.mesh.snapshot(broker, 1)
        attack.mesh.accept_snapshot(broker, Snapshot(1, 1, nodes(20, broker), size=size))
    assert [broker for what, broker, _ in attack.warnings if what == "postponed"] == [FAKE + 1, FAKE + 3]
    assert attack.mesh.limited == 2
    asked(attack)
    assert beat(attack, 3) == []
    finish(attack)
    assert keys_of(attack, FAKE) == {*range(FAKE, FAKE + 20)}
    assert keys_of(attack, FAKE + 1) == set()
    assert keys_of(attack, FAKE + 2) == {*range(FAKE + 2, FAKE + 22)}
    assert attack.mesh.sessions.memory.importing == 0
    attack.mesh.send_heartbeat()  # one of them: they would be too large together again
    assert asked(attack) == [FAKE + 1]
    attack.mesh.accept_snapshot(FAKE + 1, Snapshot(1, 1, nodes(20), size=100_000))
    finish(attack)
    attack.mesh.send_heartbeat()
    assert asked(attack) == [FAKE + 3]
    finish(attack)
    assert keys_of(attack, FAKE + 1) == {*range(10, 30)}


def test_who_answers_no_more_keeps_no_postponed_snapshot_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Case 66: of those that had no space one is requested at a heartbeat, each in its turn."""
    monkeypatch.setattr(slices, "SLICE", 10)
    monkeypatch.setattr(broker_session, "MAX_PAUSE", 2)
    attack = Attack()
    first, silent, honest = FAKE, range(FAKE + 1, FAKE + 6), FAKE + 6
    for broker in (first, *silent, honest):
        attack.mesh.add_broker(broker)
        attack.mesh.snapshot(broker, 1)
        snapshot = Snapshot(1, 1, nodes(20, 100 * broker), size=broker_session.MAX_TOTAL_BYTES)
        attack.mesh.accept_snapshot(broker, snapshot)
    finish(attack)
    asked(attack)
    assert honest in beat(attack, 20)


def test_a_broker_may_change_so_much_in_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 66: further changes are counted, and are in the snapshot that it is asked for later."""
    monkeypatch.setattr(standing, "MAX_CHANGES", 30)
    monkeypatch.setattr(standing, "CHANGES_PER_HEARTBEAT", 2)
    attack = Attack()
    attack.change(*nodes(40))
    assert len(keys_of(attack, THERE)) == 30
    assert attack.mesh.limited == 1
    assert [what for what, *_ in attack.warnings] == ["slowed down"]
    assert asked(attack) == []
    attack.change(frames.Node(7, "/other"), broker=OTHER)
    assert 7 in keys_of(attack, OTHER)
    attack.mesh.send_heartbeat()
    assert asked(attack) == [THERE]
    attack.mesh.accept_snapshot(THERE, Snapshot(1, 100, (NODE, *nodes(40))))
    assert len(keys_of(attack, THERE)) == 41
    attack.mesh.receive(THERE, Change(101, frames.Node(60, "/n60")))
    beats = 0
    while not asked(attack):
        attack.mesh.send_heartbeat()
        beats += 1
    assert beats in range(5, 20)


def test_bans_end_and_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 67: a broker that breaks a rule is asked again after a while, a longer one each time."""
    monkeypatch.setattr(standing, "FORGIVEN", 100)
    attack = Attack()

    def banned() -> int:
        attack.mesh.reject(THERE, "test")
        assert THERE not in attack.mesh.sessions
        beats = 0
        while THERE not in asked(attack):
            attack.mesh.send_heartbeat()
            beats += 1
        return beats

    first = standing.FIRST_BAN
    assert [banned(), banned(), banned()] == [first, 2 * first, 4 * first]
    assert [banned() for _ in range(6)][-1] == standing.MAX_BAN
    for _ in range(101):
        attack.mesh.send_heartbeat()
    assert banned() == first


def test_requests_for_the_snapshot_have_a_limit_for_each_asker() -> None:
    """Case 69: strangers share one, and what they ask takes nothing from brokers."""
    attack = Attack()
    strangers = [attack.mesh.admits_query(0) for _ in range(1000)]
    assert strangers.count(True) == mesh.MAX_ANSWERS_TO_STRANGERS
    for broker in (THERE, OTHER):
        answers = [attack.mesh.admits_query(broker) for _ in range(100)]
        assert answers.count(True) == mesh.MAX_ANSWERS
    assert attack.mesh.limited == 1200 - mesh.MAX_ANSWERS_TO_STRANGERS - 2 * mesh.MAX_ANSWERS
    attack.mesh.send_heartbeat()
    assert attack.mesh.admits_query(THERE)


def test_a_snapshot_is_encoded_once_for_all_askers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 69: until an endpoint comes or goes."""
    attack, encoder, encoded = Attack(), wire.SnapshotEncoder(), list[frames.Frame]()

    def count(frame: frames.Frame) -> bytes:
        encoded.append(frame)
        return encode(frame)

    monkeypatch.setattr("broker.mesh.wire.encode", count)
    for broker in (THERE, OTHER, THERE):
        payload = encoder.encode(attack.mesh.snapshot(broker, 1))
    declared = attack.mesh.snapshot(THERE, 1).declarations
    assert wire.MessageDecoder().snapshot(payload).declarations == declared
    assert encoded == list(declared)
    attack.broker.send(attack.node, make.subscription(8))
    encoder.encode(attack.mesh.snapshot(THERE, 1))
    assert len(encoded) == 2 * len(declared) + 1


@pytest.mark.parametrize("position", [0, 1])
def test_a_malformed_declaration_in_a_large_snapshot_rejects_its_broker(
    position: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 66: it shows in a later slice, and the broker leaves no trace."""
    monkeypatch.setattr(slices, "SLICE", 10)
    attack = Attack()
    attack.mesh.receive(THERE, Change(99, frames.Undeclare(50)))
    bad = (frames.Ping(1),)
    declarations = (*bad, *nodes(50)) if position == 0 else (*nodes(50), *bad)
    payload = wire.encode_snapshot(Snapshot(1, 99, (NODE, *declarations)))
    attack.mesh.accept_snapshot(THERE, wire.MessageDecoder().lazy_snapshot(payload))
    finish(attack)
    assert HERE not in attack.mesh.sessions
    attack.assert_rejected()
