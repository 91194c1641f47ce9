"""Queries for snapshots in the number of another broker, by a session that is let into the mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.mesh import wire
from tests.hostile.mesh_attacks import PREFIX, zenoh_client
from tests.integration.mesh.stations import NEVER_SILENT, check_traffic, make_brokers, start_all

if TYPE_CHECKING:
    from contextlib import AsyncExitStack

    from tests.integration.conftest import System


async def test_queries_in_the_number_of_another_broker_are_ignored(
    system: System, stack: AsyncExitStack
) -> None:
    """Case 67: a greater epoch in one would make the asked broker forget the other's endpoints."""
    brokers = make_brokers(system, ((), (0,)))
    stations = await start_all(brokers, stack, *NEVER_SILENT)
    await check_traffic(*stations)
    with zenoh_client(brokers[0].endpoint) as session:
        numbers: set[str] = set()
        while len(numbers) < 2:
            answers = session.get(f"{PREFIX}/brokers/*/graph", timeout=1.0)
            numbers |= {str(each.ok.key_expr).split("/")[4] for each in answers if each.ok is not None}
        one, other = numbers
        for epoch in range(2**40, 2**40 + 3):
            for asked, asker in ((one, other), (other, one)):
                payload = wire.encode_ask(int(asker, 16), epoch)
                assert not [*session.get(f"{PREFIX}/brokers/{asked}/graph", payload=payload, timeout=2.0)]
            await check_traffic(*stations)
