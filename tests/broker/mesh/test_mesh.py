"""Two and more brokers without I/O: what their nodes see of each other."""

from __future__ import annotations

from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.mesh.network import Network


def test_a_message_reaches_a_subscription_of_another_broker() -> None:
    """The batch arrives byte for byte, and is attached before."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    assert a.read(talker, frames.Matched)[-1] == frames.Matched(1, 1, 1)
    batch = make.batch(publisher, 0)
    a.send(talker, batch)
    network.settle()
    _, matched, attached, got = b.read_all(listener)
    assert matched == frames.Matched(1, 1, 1)
    assert isinstance(attached, frames.Attached)
    assert attached.node == "/talker"
    assert isinstance(got, frames.Batch)
    assert bytes(got.raw) == bytes(batch.raw)


def test_nothing_is_sent_twice_or_back() -> None:
    """With three brokers each subscription gets each message once, and nothing returns to its sender."""
    network = Network(3)
    a, *_ = network
    talker = a.join("/talker")
    publisher = a.publisher(talker, make.publisher(1))
    listeners = [(each, each.join(f"/listener{each.number}")) for each in network]
    for broker, listener in listeners:
        broker.send(listener, make.subscription(1), make.subscription(2))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    network.settle()
    for broker, listener in listeners:
        (batch,) = broker.read(listener, frames.Batch)
        assert (batch.first_sequence, batch.length) == (0, 3)


def test_late_joiners_get_latched_messages_from_any_broker() -> None:
    """The first one of a broker and the others, whatever was published between."""
    network = Network()
    a, b = network
    talker = a.join("/talker")
    publisher = a.publisher(talker, make.publisher(1, qos={**make.LATCHED, "depth": 5}))
    a.send(talker, make.batch(publisher, 0, 8))
    network.settle()
    first = b.join("/first")
    b.send(first, make.subscription(1))  # VOLATILE
    network.settle()
    (attached,) = b.read(first, frames.Attached)
    assert attached.first_sequence == 8
    second = b.join("/second")
    b.send(second, make.subscription(1, qos={**make.LATCHED, "depth": 10}))
    network.settle()
    replays = b.read(second, frames.Replay)
    assert [number for each in replays for number in _numbers(each)] == [3, 4, 5, 6, 7]
    a.send(talker, make.batch(publisher, 8))
    network.settle()
    assert [_numbers(each) for each in b.read(second, frames.Batch)] == [[8]]
    assert [_numbers(each) for each in b.read(first, frames.Batch)] == [[8]]


def _numbers(batch: frames.Batch | frames.Replay) -> list[int]:
    return list(range(batch.first_sequence, batch.first_sequence + batch.length))


def test_keep_all_holds_the_publisher_of_another_broker_back() -> None:
    """Its credit is what the remote subscription grants."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    b.send(listener, make.subscription(1, qos=make.KEEP_ALL, window=10))
    network.settle()
    assert a.read(talker, frames.Credit)[-1].sequence_limit == 10
    b.send(listener, frames.Grant(1, publisher, 25, 1000))
    network.settle()
    assert a.read(talker, frames.Credit)[-1].sequence_limit == 25


def test_calls_cross_brokers() -> None:
    """A request, its reply, and a cancellation."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, make.request(1, 5, 6))
    network.settle()
    (request,) = b.read(server, frames.Request)
    assert request.endpoint == 7
    first, second = (entry.call for entry in request.entries)
    b.send(server, make.reply(7, first, body=b"done"))
    network.settle()
    (reply,) = a.read(caller, frames.Reply)
    assert [(entry.call, entry.body) for entry in reply.entries] == [(5, b"done")]
    a.send(caller, frames.Cancel(1, (6,)))
    network.settle()
    assert b.read(server, frames.Cancel) == [frames.Cancel(7, (second,))]


def test_a_local_server_comes_first() -> None:
    """A remote one is called when it has gone."""
    network = Network()
    a, b = network
    caller, near, far = a.join("/caller"), a.join("/near"), b.join("/far")
    b.send(far, make.service(1))
    a.send(caller, make.client(1))
    network.settle()
    a.send(near, make.service(1))
    a.send(caller, make.request(1, 1, 2))
    network.settle()
    assert len(a.read(near, frames.Request)[0].entries) == 2
    a.leave(near)
    a.send(caller, make.request(1, 3))
    network.settle()
    assert len(b.read(far, frames.Request)[0].entries) == 1


def test_calls_fail_when_the_brokers_part() -> None:
    """The caller learns it at once, and the handler is cancelled."""
    network = Network()
    a, b = network
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1))
    b.send(server, make.service(7))
    network.settle()
    a.send(caller, make.request(1, 5))
    network.settle()
    b.read_all(server)
    network.partition(2)
    (reply,) = a.read(caller, frames.Reply)
    assert reply.entries[0].status != 0
    assert len(b.read(server, frames.Cancel)) == 1


def test_after_healing_messages_continue() -> None:
    """Each subscription has what was latched meanwhile, and then what is new, once."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    qos = {**make.LATCHED, "depth": 2}
    publisher = a.publisher(talker, make.publisher(1, qos=qos))
    b.send(listener, make.subscription(1, qos=qos))
    network.settle()
    a.send(talker, make.batch(publisher, 0, 3))
    network.settle()
    b.read_all(listener)
    network.partition(2)
    a.send(talker, make.batch(publisher, 3, 4))
    network.settle()
    assert {type(each) for each in b.read_all(listener)} == {frames.Detached, frames.Matched}
    network.heal(2)
    a.send(talker, make.batch(publisher, 7))
    network.settle()
    got = [each for each in b.read_all(listener) if isinstance(each, (frames.Batch, frames.Replay))]
    assert [number for each in got for number in _numbers(each)] == [5, 6, 7]


def test_a_publisher_that_leaves_is_detached_after_its_messages() -> None:
    """Its last batch reaches the readers first."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1))
    b.send(listener, make.subscription(1))
    network.settle()
    b.read_all(listener)
    a.send(talker, make.batch(publisher, 0))
    a.send(talker, frames.Undeclare(0))
    network.settle()
    kinds = [type(each) for each in b.read_all(listener)]
    assert kinds.index(frames.Batch) < kinds.index(frames.Detached)


def test_names_are_unique_in_the_mesh() -> None:
    """A name of another broker's node is refused."""
    network = Network()
    a, b = network
    a.join("/talker")
    network.settle()
    again = b.join()
    b.send(again, frames.Node(0, "/talker"))
    assert len(b.read(again, frames.Refused)) == 1


def test_a_keep_all_reader_of_one_broker_holds_back_no_other_broker() -> None:
    """A KEEP_LAST publisher sends to all brokers at once; the reader's own broker keeps what it may keep."""
    network = Network(3)
    a, b, c = network
    talker, slow, fast = a.join("/talker"), b.join("/slow"), c.join("/fast")
    publisher = a.publisher(talker, make.publisher(1, qos={"depth": 4}))
    b.send(slow, make.subscription(1, qos=make.KEEP_ALL, window=2))
    c.send(fast, make.subscription(1, qos={"depth": 100}))
    network.settle()
    read: list[int] = []
    for number in range(10):
        a.send(talker, make.batch(publisher, number))
        network.settle()
        read += [each.first_sequence for each in b.read(slow, frames.Batch)]
    assert read == [0, 1]
    assert [each.first_sequence for each in c.read(fast, frames.Batch)] == list(range(10))
    b.send(slow, frames.Grant(1, publisher, 100, 10_000))
    network.settle()
    assert [each.first_sequence for each in b.read(slow, frames.Batch)] == [6, 7, 8, 9]
