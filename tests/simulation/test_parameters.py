"""Parameters that are set during faults: each call ends, and both sides agree afterwards."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from tests.simulation.network import BROKER
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import Any

NAMES = ("left", "right")
ENDS_SEC = 20.0
"""Longer than any call may take: its own deadline is 10 s."""


class Setting:
    """A node with two parameters, and a client that sets both to one number again and again."""

    def __init__(self, server: actors.Node, caller: actors.Node) -> None:
        server.declare_parameters("", [(name, 0) for name in NAMES])
        self.server = server
        self.client = actors.ParameterClient(caller, "/server")
        self.ends: list[object] = []
        """The number that was set, or the error."""
        self.seen: list[int] = []
        handler = actors.ParameterEventHandler(caller)
        handler.add_parameter_callback("left", "/server", lambda left: self.seen.append(int(str(left.value))))

    async def set_until(self, stop: asyncio.Event) -> None:
        """Set both, atomically, one call after the other."""
        number = 0
        while not stop.is_set():
            number += 1
            both = [actors.Parameter(name, value=number) for name in NAMES]
            try:
                result = await self.client.set_parameters_atomically(both, timeout_sec=10)
            except actors.CallFailed as error:
                self.ends.append(error)
                await asyncio.sleep(0.05)
            else:
                assert result.successful
                self.ends.append(number)
            assert self.own[0] == self.own[1]

    @property
    def own(self) -> list[object]:
        """The values that the node itself has."""
        return [each.value for each in self.server.get_parameters(NAMES)]

    @property
    def succeeded(self) -> list[int]:
        """The numbers whose calls were successful."""
        return [end for end in self.ends if isinstance(end, int)]


async def _crash(stage: Stage) -> None:
    await stage.crash_broker()
    await asyncio.sleep(1)
    await stage.start_broker()


async def _cut_server(stage: Stage) -> None:
    stage.network.drop("server")


async def _cut_caller(stage: Stage) -> None:
    stage.network.drop("caller")


async def _silence_server(stage: Stage) -> None:
    stage.network.block("server", BROKER)
    await asyncio.sleep(5)
    stage.network.heal()


@pytest.mark.parametrize("fault", [_crash, _cut_server, _cut_caller, _silence_server])
@pytest.mark.parametrize("seed", range(3))
def test_setting_ends_and_both_sides_agree(
    fault: Callable[[Stage], Coroutine[Any, Any, None]], seed: int
) -> None:
    """Calls in flight end with a reply or CallFailed; afterwards the client reads what the node has."""

    async def scene(stage: Stage) -> None:
        setting = Setting(
            await stage.enter("server", start_parameter_services=True), await stage.enter("caller")
        )
        assert await setting.client.wait_for_services(5)
        stop = asyncio.Event()
        calling = asyncio.create_task(setting.set_until(stop))
        await stage.until(lambda: len(setting.succeeded) > 10)
        await fault(stage)
        before = len(setting.succeeded)
        await stage.until(lambda: len(setting.succeeded) > before + 10, ENDS_SEC)
        stop.set()
        await calling
        found = await setting.client.get_parameters(NAMES)
        assert [each.value for each in found] == setting.own == [setting.succeeded[-1]] * 2
        assert all(isinstance(end, int | actors.CallFailed) for end in setting.ends)
        await stage.until(lambda: setting.seen[-1:] == setting.own[:1])
        assert setting.seen == sorted(set(setting.seen))  # in order, at most once

    play(scene, seed)


def test_a_call_that_fails_may_have_set_the_value() -> None:
    """The node's link breaks before the reply: the call fails at once, and a read tells the outcome."""

    async def scene(stage: Stage) -> None:
        server = await stage.enter("server", start_parameter_services=True)
        server.declare_parameter("speed", 1)

        def cut(parameters: list[actors.Parameter]) -> None:
            if parameters[0].value == 2:
                stage.network.drop("server")

        server.add_post_set_parameters_callback(cut)
        client = actors.ParameterClient(await stage.enter("caller"), "/server")
        assert await client.wait_for_services(5)
        began = stage.loop.time()
        with pytest.raises(actors.ServiceUnavailable):
            await client.set_parameters([actors.Parameter("speed", value=2)])
        assert stage.loop.time() - began < 1
        assert await client.wait_for_services(10)
        (speed,) = await client.get_parameters(["speed"])
        assert speed.value == server.get_parameter("speed").value == 2

    play(scene)
