"""Transitions of a node with states while the network fails: each ends once, for the node and its caller."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import LifecycleState, TransitionCallbackReturn
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetState
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

TRANSITION_SEC = 2.0

NOTICED_SEC = 5.0
"""Within this both ends of a silent link have noticed."""


class Managed(actors.LifecycleNode):
    """Takes its time to be configured."""

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.begun = 0
        self.ended = 0

    async def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.begun += 1
        assert state.label == "unconfigured"
        await asyncio.sleep(TRANSITION_SEC)
        self.ended += 1
        return TransitionCallbackReturn.SUCCESS


async def restart_broker(stage: Stage) -> None:
    await stage.crash_broker()
    await asyncio.sleep(0.1)
    await stage.start_broker()


async def drop_caller(stage: Stage) -> None:
    stage.network.drop("caller")


async def drop_managed(stage: Stage) -> None:
    stage.network.drop("managed")


async def isolate_managed(stage: Stage) -> None:
    stage.network.partition("managed")
    await asyncio.sleep(NOTICED_SEC)
    stage.network.heal()


@pytest.mark.parametrize("at", [0.0, 0.001, 0.002, 0.005, 1.0, 1.999, 2.0, 2.001, 2.005])
@pytest.mark.parametrize("fault", [restart_broker, drop_caller, drop_managed, isolate_managed])
def test_a_transition_ends_once(fault: Callable[[Stage], Coroutine[Any, Any, None]], at: float) -> None:
    """The caller hears of success or gets a typed error; the node is configured once, or was never asked."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter_as(Managed, "managed")
        caller = await stage.enter("caller")
        change = caller.create_client(ChangeState, "/managed/change_state")
        read = caller.create_client(GetState, "/managed/get_state")
        assert await change.wait_for_service(5)
        began = stage.loop.time()

        async def configure() -> bool | None:
            request = ChangeState.Request(transition=Transition(label="configure"))
            try:
                return (await change.call(request, 60)).success
            except actors.ServiceUnavailable:
                return None

        configuring = asyncio.ensure_future(configure())
        await asyncio.sleep(at)
        await fault(stage)
        success = await configuring
        assert stage.loop.time() - began < at + TRANSITION_SEC + NOTICED_SEC + 1
        await asyncio.sleep(TRANSITION_SEC)
        assert (success is True) <= (node.ended == 1)
        assert node.begun == node.ended <= 1
        assert success is not False
        assert await read.wait_for_service(20)
        state = (await read.call(GetState.Request(), 5)).current_state.label
        assert state == node.current_state.label == ("inactive" if node.ended else "unconfigured")

    play(scene, seed=round(at * 1000))


def test_callers_that_compete() -> None:
    """Of many that request one transition at once, exactly one succeeds; the others are refused at once."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter_as(Managed, "managed")
        callers = [await stage.enter(f"caller{number}") for number in range(5)]
        clients = [caller.create_client(ChangeState, "/managed/change_state") for caller in callers]
        for client in clients:
            assert await client.wait_for_service(5)
        request = ChangeState.Request(transition=Transition(label="configure"))
        replies = await asyncio.gather(*(client.call(request, 10) for client in clients))
        assert sorted(reply.success for reply in replies) == [False] * 4 + [True]
        assert node.begun == 1

    play(scene)
