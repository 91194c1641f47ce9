"""How often the dialer tries again."""

from __future__ import annotations

import asyncio

import pytest

from actors.dialer import FIRST_RETRY_SEC, LAST_RETRY_SEC
from tests.simulation.stage import Stage, play


@pytest.mark.parametrize("lasting", [True, False])
def test_after_a_session_that_lasted_it_begins_again_with_short_pauses(*, lasting: bool) -> None:
    """One that broke at once lets them go on growing: a broker that crashes at start is not stormed."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("node")
        await stage.crash_broker()
        await asyncio.sleep(60)  # the pauses have grown to their limit
        await stage.start_broker()
        await stage.until(lambda: node.connected)
        await asyncio.sleep(LAST_RETRY_SEC + 1 if lasting else 0.01)
        await stage.crash_broker()
        await stage.until(lambda: not node.connected)
        await stage.start_broker()
        took = await stage.until(lambda: node.connected)
        if lasting:
            assert took < 4 * FIRST_RETRY_SEC
        else:
            assert took > LAST_RETRY_SEC / 4

    play(scene)
