"""What brokers ask each other: definitions of types, and signs of life."""

from __future__ import annotations

from typing import Final

from broker.mesh.engine.member import PAUSE_US, VALID_US, RoundTrips
from broker.mesh.messages import Direct
from proto.wire import frames
from proto.wire.identity import VERSION
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker, Network

DEFINITION: Final = b"definition"
HASH: Final = hash_of(DEFINITION)


def publisher(definition: bytes | None = DEFINITION) -> frames.Publisher:
    """Return the declaration of a publisher with a definition."""
    return make.publisher(1, type_hash=HASH)._replace(definition=definition)


def described(broker: MeshBroker, peer: int) -> list[bytes | None]:
    """Return the answers that a peer has got."""
    return [frame.definition for frame in broker.read(peer, frames.Definition)]


def test_the_definition_is_found_at_the_broker_that_has_it() -> None:
    """Also if another one has the type without its definition, and as often as somebody asks."""
    network = Network(4)
    a, b, c, d = network
    for broker, definition in ((a, DEFINITION), (b, None), (c, None)):
        broker.publisher(broker.join(f"/talker{broker.number}"), publisher(definition))
    network.settle()
    one, two = d.join(), d.join()
    d.send(one, frames.Describe(HASH))
    d.send(two, frames.Describe(HASH))
    assert described(d, one) == []
    network.settle()
    assert described(d, one) + described(d, two) == [DEFINITION] * 2
    d.send(one, frames.Describe(HASH))
    network.settle()
    assert described(d, one) == [DEFINITION]


def test_an_unknown_type_is_answered_at_once() -> None:
    """No other broker has it, so that none is asked; what nobody has defined is nil."""
    network = Network()
    a, b = network
    reader = b.join()
    b.send(reader, frames.Describe(HASH))
    assert described(b, reader) == [None]
    a.publisher(a.join("/talker"), publisher(None))
    network.settle()
    b.send(reader, frames.Describe(HASH))
    network.settle()
    assert described(b, reader) == [None]


def test_another_definition_is_not_believed() -> None:
    """What has another hash, or comes from a broker that has not been asked, reaches nobody."""
    network = Network(3)
    a, b, _ = network
    a.publisher(a.join("/talker"), publisher())
    network.settle()
    reader = b.join()
    b.send(reader, frames.Describe(HASH))
    b.mesh.receive(3, Direct(2, 1, 1, 0, frames.Definition(HASH, DEFINITION)))
    b.mesh.receive(1, Direct(2, 1, 1, 0, frames.Definition(HASH, b"false")))
    assert described(b, reader) == [None]


def test_no_question_waits_for_ever() -> None:
    """A broker that leaves or is silent is given up."""
    network = Network(3)
    a, b, c = network
    a.publisher(a.join("/talker"), publisher())
    c.publisher(c.join("/other"), publisher())
    network.settle()
    reader = b.join()
    b.send(reader, frames.Describe(HASH))
    network.cut.update({1, 3})
    b.mesh.remove_broker(3)
    assert described(b, reader) == []
    for _ in range(3):
        b.mesh.send_heartbeat()
    assert described(b, reader) == [None]


def test_brokers_know_each_others_names_and_versions() -> None:
    """They come with the snapshots; of a broker that is gone nothing is known."""
    network = Network(3)
    a, *_ = network
    assert a.mesh.sessions.names() == {2: ("broker2", VERSION), 3: ("broker3", VERSION)}
    network.partition(2)
    assert a.mesh.sessions.names() == {3: ("broker3", VERSION)}


def test_every_other_broker_answers_a_ping() -> None:
    """With its token."""
    network = Network(3)
    a, *_ = network
    answers: list[tuple[int, int]] = []
    a.mesh.queries.ponged = lambda *answer: answers.append(answer)
    a.mesh.queries.ping(a.mesh.sessions.names(), 77)
    network.settle()
    assert sorted(answers) == [(2, 77), (3, 77)]


def test_round_trips_are_measured_again_after_a_pause_and_forgotten_later() -> None:
    """Answers to an earlier PING do not count."""
    trips = RoundTrips()
    now = 5 * PAUSE_US
    assert trips.begin(now)
    trips.record(2, now, now + 300)
    trips.record(3, now - 1, now + 300)
    assert trips.by_broker == {2: 300}
    assert not trips.begin(now + PAUSE_US - 1)
    assert trips.begin(now + PAUSE_US)
    assert trips.by_broker == {2: 300}
    assert trips.begin(now + PAUSE_US + VALID_US + 1)
    assert trips.by_broker == {}
