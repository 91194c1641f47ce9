"""What INSPECT answers about the mesh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from broker.routing.router import Router
from broker.serving.stats import Statistics
from proto.wire.stats import BrokerStats, MeshBrokerStats, MeshStats
from tests.broker.routing.test_router_access import NOTHING, user

BROKERS = (MeshBrokerStats(1, "a", "0.1"), MeshBrokerStats(2, "b", "0.1", True, *range(1, 6)))
MESH = MeshStats(brokers=1, sent=5)


@pytest.mark.parametrize(
    ("principal", "brokers", "mesh"),
    [
        (None, BROKERS, MESH),
        (user(administer="/**"), BROKERS, MESH),
        (NOTHING, tuple(each[:3] + MeshBrokerStats(0, "", "")[3:] for each in BROKERS), MeshStats()),
    ],
)
def test_only_names_and_versions_are_for_everybody(principal: Any, brokers: Any, mesh: MeshStats) -> None:
    """Traffic and losses are for users who may administer the broker."""
    router = Router()
    peer, _ = router.connect(b"i", b"t", principal)
    member = SimpleNamespace(brokers=lambda _domain: BROKERS, totals=lambda: MESH)
    dispatcher: Any = SimpleNamespace(joined={router: {}}, mesh=member)
    link: Any = SimpleNamespace(peer=peer, session=1)
    frames = list(Statistics("b", dispatcher).answer(0.0, router, link, BrokerStats(connections=7)))
    assert tuple(broker for frame in frames for broker in frame.brokers) == brokers
    assert MeshStats.from_map(frames[0].mesh) == mesh
    assert all(not frame.mesh for frame in frames[1:])


def test_withheld_totals_have_the_time_only() -> None:
    """Rates of the topics that a user may administer need it."""
    router = Router()
    peer, _ = router.connect(b"i", b"t", NOTHING)
    dispatcher: Any = SimpleNamespace(joined={router: {}}, mesh=None)
    link: Any = SimpleNamespace(peer=peer, session=1)
    totals = BrokerStats(broker="b", stamp_sec=5.0, connections=7)
    (frame,) = Statistics("b", dispatcher).answer(0.0, router, link, totals)
    assert BrokerStats.from_map(frame.totals) == BrokerStats(stamp_sec=5.0)
    assert BrokerStats.from_map(frame.totals).withheld
