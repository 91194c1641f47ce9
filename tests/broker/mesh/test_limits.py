"""Each other broker has limits of its own, like a connection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing import latched
from proto.wire.codes import Status
from tests.broker import frame_makers as make
from tests.broker.mesh.attack import NODE, OTHER, THERE, Attack
from tests.seams.brokers import endpoint_keys

if TYPE_CHECKING:
    import pytest


def test_matches_of_one_broker_have_a_limit() -> None:
    """Endpoints beyond it are refused; another broker's are not, and count for it alone."""
    attack = Attack(max_mesh_matches=4)  # broker 2 has used 3
    attack.change(make.publisher(5, node=1), make.publisher(6, node=1))
    attack.change(make.publisher(5, node=1), make.subscription(6, node=1), broker=OTHER)
    keys = endpoint_keys(attack.broker.router)
    assert THERE << 32 | 5 in keys
    assert THERE << 32 | 6 not in keys
    assert {OTHER << 32 | 5, OTHER << 32 | 6} <= keys
    assert {what for what, *_ in attack.warnings} == {"refused an endpoint of"}


def test_endpoints_of_other_brokers_do_not_count_as_matches_of_each_other() -> None:
    """They are not matched, however many there are."""
    attack = Attack(max_mesh_matches=4)
    for number in range(5, 20):
        attack.change(make.publisher(number, "/far", node=1))
        attack.change(make.subscription(number, "/far", node=1), broker=OTHER)
        attack.change(make.client(number + 20, "/far", node=1))
        attack.change(make.service(number + 20, "/far", node=1), broker=OTHER)
    assert attack.warnings == []


def _requests(attack: Attack, broker: int, client: int, *calls: int, body: bytes = b"q") -> list[int]:
    """Send calls to the local server one by one, and return the status of each that was answered at once."""
    for call in calls:
        attack.direct(make.request(client, call, body=body), 3, broker=broker)
    return [frame.entries[0].status for frame, to in attack.sent() if to == broker]


def test_pending_calls_of_one_broker_have_a_limit() -> None:
    """Further ones are refused, those of another broker are not."""
    attack = Attack(max_pending_calls=2)
    attack.change(make.client(9, node=1), broker=OTHER)
    assert _requests(attack, THERE, 4, 1, 2, 3) == [Status.OVERLOADED]
    assert _requests(attack, OTHER, 9, 1, 2) == []
    attack.mesh.remove_broker(THERE)
    assert attack.broker.router.calls.pending == 2


def test_calls_of_one_broker_that_wait_for_a_server_have_a_limit() -> None:
    """The server does not read: what one broker sends leaves space for others."""
    attack = Attack(max_queued_call_bytes=3000)
    attack.change(make.client(9, node=1), broker=OTHER)
    assert _requests(attack, THERE, 4, 1, 2, 3, body=bytes(1000)) == [Status.OVERLOADED]
    assert _requests(attack, OTHER, 9, 1, 2, body=bytes(1000)) == []


def test_latched_messages_of_one_broker_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond it the broker that publishes loses its oldest; another keeps its own."""
    monkeypatch.setattr(latched, "LATCHED_BYTES_PER_LINK", 5000)
    attack = Attack()
    attack.broker.send(attack.node, make.subscription(9, "/kept"))
    for broker in (THERE, OTHER):
        attack.change(make.publisher(7, "/kept", node=1, qos={**make.LATCHED, "depth": 9}), broker=broker)
        attack.direct(attack.attached(7, broker=broker), broker=broker)
    for broker, count in ((OTHER, 2), (THERE, 6)):
        for number in range(count):
            attack.mesh.receive(broker, make.batch(broker << 32 | 7, number, size=1000))
    publishers = attack.broker.router.routes.publishers
    assert publishers[OTHER << 32 | 7].latched_messages == 2
    assert 0 < publishers[THERE << 32 | 7].latched_messages < 6
    assert attack.broker.router.routes.latched_dropped > 0


def test_counts_begin_anew_when_a_broker_returns() -> None:
    """What it had before does not count any more."""
    attack = Attack(max_mesh_matches=3)
    attack.mesh.remove_broker(THERE)
    attack.mesh.add_broker(THERE)
    attack.rejoin(NODE, make.publisher(2, node=1), make.subscription(3, node=1), make.client(4, node=1))
    assert attack.warnings == []
    attack.change(make.subscription(5, node=1))
    assert len(attack.warnings) == 1
