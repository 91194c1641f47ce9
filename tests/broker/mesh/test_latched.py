"""What brokers of a mesh keep of each other's latched messages, for late joiners."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker, Network

if TYPE_CHECKING:
    from broker.mesh.messages import Message

LATCHED = {**make.LATCHED, "depth": 5}


def test_subscriptions_that_come_together_get_what_is_latched() -> None:
    """Their broker has all of them in one snapshot when it becomes reachable."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=LATCHED))
    b.send(listener, make.subscription(1, qos=LATCHED), make.subscription(2, qos=LATCHED))
    network.settle()
    network.partition(2)
    a.send(talker, make.batch(publisher, 0, 3))
    b.read_all(listener)
    network.heal(2)
    assert _numbers(b, listener) == [0, 1, 2]


def test_what_is_latched_outlives_the_subscription_that_caused_it_to_come() -> None:
    """The first subscription of a broker leaves while latched messages are on their way to it."""
    network = Network()
    a, b = network
    talker, first, second = a.join("/talker"), b.join("/first"), b.join("/second")
    publisher = a.publisher(talker, make.publisher(1, qos=LATCHED))
    for number in range(3):
        a.send(talker, make.batch(publisher, number))
    b.send(first, make.subscription(1, qos=LATCHED))
    b.send(second, make.subscription(1, qos=LATCHED))
    for message in _sent(b):
        network.carry(b, message)
    b.leave(first)
    for message in _sent(b):
        network.carry(b, message)
    network.settle()
    assert _numbers(b, second) == [0, 1, 2]


def test_readers_of_few_messages_do_not_limit_what_late_joiners_get() -> None:
    """A broker keeps the depth of the publisher, even while its readers want less and the mesh is slow."""
    network = Network()
    a, b = network
    talker, few = a.join("/talker"), b.join("/few")
    publisher = a.publisher(talker, make.publisher(1, qos=LATCHED))
    b.send(few, make.subscription(1, qos={"depth": 1}))
    network.settle()
    for number in range(8):
        a.send(talker, make.batch(publisher, number))
    a.congest(a.mesh.peer)
    network.settle()
    late = b.join("/late")
    b.send(late, make.subscription(1, qos=LATCHED))
    assert _numbers(b, late) == [3, 4, 5, 6, 7]


def test_what_a_publisher_sends_again_is_latched_at_other_brokers() -> None:
    """It has been there before: a VOLATILE reader that comes late gets none of it, a latched one all."""
    network = Network()
    a, b = network
    talker, reader = a.join("/talker"), b.join("/reader")
    b.send(reader, make.subscription(1, qos=LATCHED))
    network.settle()
    publisher = a.publisher(talker, make.publisher(1, qos=LATCHED, live_sequence=3))
    network.settle()
    b.send(reader, make.subscription(2))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    network.settle()
    got = b.read_all(reader)
    attached = [
        (each.subscriptions, each.first_sequence) for each in got if isinstance(each, frames.Attached)
    ]
    assert attached == [((1,), 0), ((2,), 3)]


def test_credit_includes_what_a_publisher_sends_again() -> None:
    """A KEEP_ALL reader can only grant more if its broker forwards what it has not requested."""
    network = Network()
    a, b = network
    talker, reader = a.join("/talker"), b.join("/reader")
    b.send(reader, make.subscription(1, qos=make.KEEP_ALL))
    network.settle()
    publisher = a.publisher(talker, make.publisher(1, qos=LATCHED, live_sequence=3))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    network.settle()
    assert _numbers(b, reader) == [0, 1, 2]


def _numbers(broker: MeshBroker, reader: int) -> list[int]:
    got = [each for each in broker.read_all(reader) if isinstance(each, (frames.Batch, frames.Replay))]
    return sorted(
        number for each in got for number in range(each.first_sequence, each.first_sequence + each.length)
    )


def _sent(broker: MeshBroker) -> list[Message]:
    broker.forward()
    return broker.mesh.pop_messages()
