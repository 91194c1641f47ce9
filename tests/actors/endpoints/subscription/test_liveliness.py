"""Which publishers are alive: each is counted once, as alive, as silent or not at all."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.endpoints.subscription.liveliness import Liveliness
from actors.session.attachments import Attachment
from proto.wire.frames import Attached
from proto.wire.qos import MANUAL_BY_TOPIC
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine


class Counts:
    """Stands for the event: those alive, and those not."""

    def __init__(self) -> None:
        self.alive = self.silent = 0

    def add(self, alive: int, silent: int) -> None:
        self.alive += alive
        self.silent += silent

    @property
    def now(self) -> tuple[int, int]:
        return self.alive, self.silent


def played(scene: Callable[[Liveliness, Counts], Coroutine[None, None, None]]) -> None:
    """Run `scene(liveliness, counts)` on a virtual clock; no timer may be left at its end."""

    async def main(loop: SimulatedLoop) -> None:
        context: Any = SimpleNamespace(link=SimpleNamespace(loop=loop))
        event: Any = Counts()
        await scene(Liveliness(context, event), event)
        before = event.now
        await asyncio.sleep(60)
        assert event.now == before

    simulate(main, 0)


def attachment(*, lease_s: int = 1) -> Attachment:
    """Return the runs of a publisher that shows itself by hand."""
    reader: Any = None
    qos = {"liveliness": MANUAL_BY_TOPIC, "lease_ns": lease_s * 10**9}
    return Attachment(reader, Attached(1, (1,), b"g" * 16, 0, "/talker", qos))


@pytest.mark.parametrize("suspended", [False, True])
@pytest.mark.parametrize("dead", [False, True])
def test_who_leaves_is_taken_from_where_it_was_counted(*, dead: bool, suspended: bool) -> None:
    """Alive, or not since its lease ended; a suspended one counts as silent until it is forgotten."""

    async def scene(liveliness: Liveliness, counts: Counts) -> None:
        here, other = attachment(), attachment(lease_s=0)
        assert liveliness.attached(here)
        assert not liveliness.attached(other)
        await asyncio.sleep(1.5 if dead else 0.5)
        assert counts.now == ((1, 1) if dead else (2, 0))
        liveliness.detached(here, suspended=suspended)
        assert counts.now == ((1, 1) if suspended else (1, 0))
        if suspended:
            liveliness.suspension_ended()
        assert counts.now == (1, 0)

    played(scene)


def test_a_sign_of_life_after_the_lease_brings_it_back_once() -> None:
    """Further ones change nothing, and the lease begins anew."""

    async def scene(liveliness: Liveliness, counts: Counts) -> None:
        here = attachment()
        liveliness.attached(here)
        await asyncio.sleep(1.5)
        for _ in range(3):
            liveliness.mark_alive(here)
            assert counts.now == (1, 0)
        await asyncio.sleep(1.5)
        assert counts.now == (0, 1)

    played(scene)


def test_when_it_is_stopped_no_lease_ends() -> None:
    """The subscription has been destroyed: whatever its publishers do, it counts no more."""

    async def scene(liveliness: Liveliness, counts: Counts) -> None:
        liveliness.attached(attachment())
        await asyncio.sleep(0.5)
        liveliness.stop()
        await asyncio.sleep(5)
        assert counts.now == (1, 0)

    played(scene)
