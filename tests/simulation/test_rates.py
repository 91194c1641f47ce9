"""A timer's rate at a subscription, on a clock that does not depend on the machine."""

from __future__ import annotations

import asyncio
import time
from unittest import mock

import pytest

from actors.cli.measuring import RateMeter
from tests.simulation.records import Note
from tests.simulation.stage import Stage, play


def test_a_timer_of_one_hertz_is_received_at_one_hertz() -> None:
    """The rate is within one percent from the second message on."""

    async def scene(stage: Stage) -> None:
        talker, listener = await stage.enter("talker"), await stage.enter("listener")
        meter = RateMeter("/red", None, lambda _: True)
        listener.create_subscription(None, "red", meter.add, 10, raw=True)
        publisher = talker.create_publisher(Note, "red")
        await stage.until(lambda: publisher.get_subscription_count() == 1)
        talker.create_timer(1.0, lambda: publisher.publish(Note()))
        for seconds in range(1, 30):
            await asyncio.sleep(1.0)
            found = meter.rate.summary()
            if seconds > 2:
                assert found is not None
                assert found.per_sec == pytest.approx(1.0, rel=0.01)
                assert found.window == pytest.approx(seconds, abs=1)

    def now() -> int:
        return 1_700_000_000_000_000_000 + int(asyncio.get_running_loop().time() * 1e9)

    with mock.patch.object(time, "time_ns", now):
        play(scene)
