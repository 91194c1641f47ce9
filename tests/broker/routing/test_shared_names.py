"""Node names that several nodes share: who gets one, and that the nodes stay apart."""

from __future__ import annotations

import msgpack
import pytest

from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import decode
from proto.wire.codes import EntryKind, Op
from tests.broker import frame_makers as make
from tests.broker.routing.test_router_access import user
from tests.broker.switch import Switch

SHARED = frames.Node(0, "/same", shared=True)
UNSHARED = frames.Node(0, "/same")


def refusal(switch: Switch, peer: int, frame: frames.Frame) -> str | None:
    """Return why a declaration is refused; None if it is accepted."""
    switch.send(peer, frame)
    (answer,) = [each for each in switch.read_all(peer) if isinstance(each, frames.Accepted | frames.Refused)]
    if isinstance(answer, frames.Accepted):
        return None
    assert answer.code == ErrorCode.NAME_TAKEN
    return answer.text


def node_keys(switch: Switch, peer: int) -> list[int]:
    """Return the keys of the nodes named /same that a peer sees."""
    switch.send(peer, frames.Watch(99, keep=False))
    entries = [entry for frame in switch.read(peer, frames.Graph) for entry in frame.added]
    return [each.key for each in entries if each.kind == EntryKind.NODE and each.node == "/same"]


def test_nodes_that_share_a_name_are_in_the_graph_side_by_side() -> None:
    """Each has an entry of its own, on one link or several; one that leaves takes its own endpoints along."""
    switch = Switch()
    first, second, watcher = switch.join(), switch.join(), switch.join("/watcher")
    assert refusal(switch, first, SHARED) is None
    assert refusal(switch, second, SHARED) is None
    assert refusal(switch, second, SHARED._replace(id=1)) is None
    assert len(set(node_keys(switch, watcher))) == 3
    switch.send(watcher, make.subscription(5))
    one, other = switch.publisher(first, make.publisher(2)), switch.publisher(second, make.publisher(2))
    switch.send(second, frames.Undeclare(0))
    switch.send(first, make.batch(one, 0))
    received = switch.read_all(watcher)
    assert [frame.publisher for frame in received if isinstance(frame, frames.Batch)] == [one]
    assert [frame.publisher for frame in received if isinstance(frame, frames.Detached)] == [other]
    switch.leave(first)
    assert len(node_keys(switch, watcher)) == 1


@pytest.mark.parametrize(
    ("holder", "newcomer", "remedy"),
    [
        (SHARED, UNSHARED, "or share the name as that one does"),
        (UNSHARED, SHARED, "does not share its name; give this one another name"),
        (UNSHARED, UNSHARED, "is there already; give this one another name"),
    ],
)
def test_a_name_is_shared_only_if_every_holder_shares_it(
    holder: frames.Node, newcomer: frames.Node, remedy: str
) -> None:
    """Otherwise the second is refused, with what to do; when the holder has gone it gets the name."""
    switch = Switch()
    first, second = switch.join(), switch.join()
    assert refusal(switch, first, holder) is None
    text = refusal(switch, second, newcomer)
    assert text is not None
    assert text.endswith(remedy)
    switch.send(first, frames.Undeclare(0))
    assert refusal(switch, second, newcomer) is None


def test_a_node_yields_its_name_to_one_that_does_not_share_it() -> None:
    """It and its endpoints are refused, and leave the graph; one that shares the name comes beside it."""
    switch = Switch()
    first, second, third = switch.join(), switch.join(), switch.join("/watcher")
    assert refusal(switch, first, SHARED._replace(yields=True)) is None
    assert refusal(switch, third, SHARED._replace(id=1, yields=True)) is None
    number = switch.publisher(first, make.publisher(2, "/up"))
    switch.read_all(first)
    assert refusal(switch, second, SHARED) is None
    assert len(node_keys(switch, third)) == 3
    switch.send(second, frames.Undeclare(0))
    assert refusal(switch, second, UNSHARED) is None
    refused = [each for each in switch.read_all(first) if isinstance(each, frames.Refused)]
    assert [(each.id, each.code) for each in refused] == [
        (0, ErrorCode.NAME_TAKEN),
        (2, ErrorCode.NAME_TAKEN),
    ]
    assert "a node named '/same' has come" in refused[0].text
    assert len(node_keys(switch, third)) == 1
    switch.send(first, make.batch(number, 0))  # on its way meanwhile: not an error
    assert refusal(switch, first, SHARED._replace(id=3, yields=True)) == (
        "A node named '/same' is there already and does not share its name; give this one another name"
    )


def test_a_link_may_yield_names_without_end() -> None:
    """Of its publishers that are gone, the broker remembers as many as it may declare."""
    switch = Switch(Router(limits=RouterLimits(max_endpoints=2)))
    first, second = switch.join(), switch.join()
    numbers: list[int] = []
    for _ in range(3):
        assert refusal(switch, first, SHARED._replace(yields=True)) is None
        numbers.append(switch.publisher(first, make.publisher(2, "/up")))
        assert refusal(switch, second, UNSHARED) is None
        switch.send(second, frames.Undeclare(0))
        switch.read_all(first)
    switch.send(first, make.batch(numbers[1], 0), make.batch(numbers[2], 0))
    with pytest.raises(ProtocolError, match="no publisher"):
        switch.send(first, make.batch(numbers[0], 0))


def test_a_node_does_not_yield_beside_one_that_only_shares_its_name() -> None:
    """The name is then somebody else's as well."""
    switch = Switch()
    first, second, third = switch.join(), switch.join(), switch.join()
    assert refusal(switch, first, SHARED._replace(yields=True)) is None
    assert refusal(switch, second, SHARED) is None
    text = refusal(switch, third, UNSHARED)
    assert text is not None
    assert text.endswith("or share the name as that one does")


def test_a_holder_that_is_silent_keeps_nobody_from_sharing() -> None:
    """Another one comes meanwhile, and the silent one returns beside it."""
    switch = Switch()
    first, second, watcher = switch.join(), switch.join(), switch.join("/watcher")
    assert refusal(switch, first, SHARED) is None
    before = node_keys(switch, watcher)
    switch.suspend(first)
    assert refusal(switch, second, SHARED) is None
    switch.restore(first)
    assert len(node_keys(switch, watcher)) == 2
    assert before[0] in node_keys(switch, watcher)


def test_one_that_does_not_share_waits_until_all_silent_holders_have_lost_the_name() -> None:
    """A live holder refuses it, a silent one lets it wait, and then all of them are replaced."""
    switch = Switch()
    first, second = switch.join(), switch.join()
    for peer in (first, second):
        assert refusal(switch, peer, SHARED) is None
    assert refusal(switch, second, SHARED._replace(id=1)) is None  # twice on one link
    switch.suspend(first)
    record = switch.router.peer(first)
    assert record is not None
    record.names_released = True
    assert refusal(switch, switch.join(), UNSHARED) is not None
    switch.suspend(second)
    with pytest.raises(ProtocolError, match="is silent"):
        switch.send(switch.join(), UNSHARED)
    record = switch.router.peer(second)
    assert record is not None
    record.names_released = True
    assert refusal(switch, switch.join(), UNSHARED) is None
    assert switch.closed == {first: ErrorCode.TAKEN_OVER, second: ErrorCode.TAKEN_OVER}


def test_a_holder_that_reconnects_replaces_only_itself() -> None:
    """A new session of one instance takes over its own link, never another holder's."""
    switch = Switch()
    first = switch.join(instance=b"1" * 16)
    second, watcher = switch.join(instance=b"2" * 16), switch.join("/watcher")
    for peer in (first, second):
        assert refusal(switch, peer, SHARED) is None
    of_first, of_second = node_keys(switch, watcher)
    again = switch.join(instance=b"1" * 16)
    assert switch.closed == {first: ErrorCode.TAKEN_OVER}
    assert refusal(switch, again, SHARED) is None
    left, new = node_keys(switch, watcher)
    assert left == of_second
    assert new not in {of_first, of_second}


def test_a_shared_name_needs_the_right_to_it() -> None:
    """Who has not got it is denied, shared or not; who loses it leaves, and the others stay."""
    switch = Switch()
    first, second = (switch.join(principal=user(node="/same", see="/**")) for _ in range(2))
    for peer in (first, second):
        assert refusal(switch, peer, SHARED) is None
    denied = switch.join(principal=user(node="/other"))
    switch.send(denied, SHARED)
    (answer,) = switch.read(denied, frames.Refused)
    assert answer.code == ErrorCode.DENIED
    of_second = node_keys(switch, second)[1]
    switch.set_principal(first, user(node="/other", see="/**"))
    (revoked,) = switch.read(first, frames.Refused)
    assert revoked.code == ErrorCode.DENIED
    assert node_keys(switch, second) == [of_second]


def test_a_frame_of_an_older_client_shares_nothing() -> None:
    """The field is at the end of the frame and has a default."""
    content = msgpack.packb([Op.NODE, 1, "/n"])
    frame = decode(b"\xc6" + len(content).to_bytes(4, "big") + content)
    assert frame == frames.Node(1, "/n", shared=False)
