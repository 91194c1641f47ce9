"""Requests of transitions while the network fails: each is answered once, and none hangs."""

from __future__ import annotations

import asyncio
import contextvars
import math
from contextlib import asynccontextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import LifecycleState, TransitionCallbackReturn
from actors.config.contexts import find_broker_target
from actors.endpoints.context import DEFAULT_CALL_TIMEOUT_SEC
from actors.launch.engine import transition_client
from actors.launch.engine.effects import RequestTransition
from actors.launch.engine.transition_client import TransitionClient
from tests.actors.launch.event_samples import spec
from tests.actors.meeting import until
from tests.simulation.network import on_host
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

    from actors.interfaces.lifecycle_msgs.msg import TransitionEvent
    from actors.launch.planning.process_spec import ProcessSpec
    from tests.actors.meeting import Meeting

TRANSITION_SEC = 2.0
LIMIT_SEC = 8.0


class Managed(actors.LifecycleNode):
    """Takes its time to be configured; cannot be activated."""

    async def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        await asyncio.sleep(TRANSITION_SEC)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.FAILURE


class Answers:
    """What a client has said."""

    def __init__(self) -> None:
        self.events: list[str] = []
        self.answers: list[tuple[int | str, str | None]] = []
        self.client: TransitionClient

    def on_event(self, process: ProcessSpec, event: TransitionEvent) -> None:
        self.events.append(f"{process.label} {event.start_state.label} {event.goal_state.label}")

    def on_answer(self, request: RequestTransition, failure: str | None) -> None:
        self.answers.append((request.transition, failure))

    def has(self, answers: int) -> bool:
        return len(self.answers) == answers

    def request(
        self, transition: int | str, node: str = "/managed", limit_sec: float = LIMIT_SEC
    ) -> RequestTransition:
        request = RequestTransition("managed-1", node, transition, limit_sec)
        self.client.request(request)
        return request


@asynccontextmanager
async def client_on(host: str, url: str | None = None) -> AsyncIterator[Answers]:
    """Run a client that watches /managed."""
    said = Answers()
    with on_host(host):
        said.client = TransitionClient(
            find_broker_target(url),
            "_launch_1_lifecycle",
            contextvars.copy_context(),
            on_event=said.on_event,
            on_answer=said.on_answer,
        )
    said.client.watch(spec("managed-1", node="/managed"))
    try:
        yield said
    finally:
        await said.client.close()


def test_transitions_are_requested_and_watched() -> None:
    """Transitions are requested by number or label and cause events; a refusal has no reason."""

    async def scene(stage: Stage) -> None:
        async with client_on("launch") as said:
            said.request(1)  # nothing is there yet
            await asyncio.sleep(1)
            await stage.enter_as(Managed, "managed")
            await stage.until(lambda: bool(said.answers))
            others: tuple[int | str, ...] = ("activate", "shutdown", 1)
            for count, wanted in enumerate(others, start=2):
                said.request(wanted)
                await stage.until(partial(said.has, count))
            assert said.answers == [(1, None), ("activate", ""), ("shutdown", None), (1, "")]
            assert said.events == [
                "managed-1 unconfigured configuring",
                "managed-1 configuring inactive",
                "managed-1 inactive activating",
                "managed-1 activating inactive",
                "managed-1 inactive shuttingdown",
                "managed-1 shuttingdown finalized",
            ]

    play(scene)


def test_a_request_waits_for_its_node_until_its_own_limit() -> None:
    """Longer than calls wait by default: the machine's first start of a program can take minutes."""

    async def scene(stage: Stage) -> None:
        async with client_on("launch") as said:
            said.request(1, limit_sec=math.inf)
            await asyncio.sleep(2 * DEFAULT_CALL_TIMEOUT_SEC)
            assert said.answers == []
            await stage.enter_as(Managed, "managed")
            await stage.until(lambda: bool(said.answers))
            assert said.answers == [(1, None)]

    play(scene)


async def crash(stage: Stage, managed: actors.Node) -> None:
    await stage.crash_broker()
    await asyncio.sleep(0.1)
    await stage.start_broker()


async def drop(stage: Stage, managed: actors.Node) -> None:
    stage.network.drop("launch")


async def isolate(stage: Stage, managed: actors.Node) -> None:
    stage.network.partition("managed")


async def destroy(stage: Stage, managed: actors.Node) -> None:
    managed.destroy_node()


@pytest.mark.parametrize("fault", [crash, drop, isolate, destroy])
@pytest.mark.parametrize("seed", range(3))
def test_a_fault_during_a_transition_is_its_answer(
    fault: Callable[[Stage, actors.Node], Coroutine[Any, Any, None]], seed: int
) -> None:
    """Once, with a reason, before the deadline; if the network recovers, the next request is answered."""

    async def scene(stage: Stage) -> None:
        managed = await stage.enter_as(Managed, "managed")
        async with client_on("launch") as said:
            said.request("configure")
            await asyncio.sleep(TRANSITION_SEC / 2)
            await fault(stage, managed)
            await stage.until(lambda: bool(said.answers), LIMIT_SEC)
            ((_, failure),) = said.answers
            assert failure
            assert "no answer" not in failure
            await asyncio.sleep(2 * LIMIT_SEC)
            stage.network.heal()
            said.request("cleanup")
            await stage.until(lambda: len(said.answers) > 1, 3 * LIMIT_SEC)
            if fault is not destroy:
                assert said.answers[1] == ("cleanup", None)
            await asyncio.sleep(2 * LIMIT_SEC)
            assert len(said.answers) == 2

    play(scene, seed)


def test_each_request_has_a_deadline() -> None:
    """If the node never appears; and also if the broker is away all the time."""

    async def scene(stage: Stage) -> None:
        for _ in range(2):
            async with client_on("launch") as said:
                said.request(1)
                took = await stage.until(partial(said.has, 1), 2 * LIMIT_SEC)
                assert took == pytest.approx(LIMIT_SEC, abs=0.1)
                assert said.answers == [(1, "no answer from '/managed/change_state' within 8 s")]
            await stage.stop_broker()

    play(scene)


def test_a_cancelled_request_says_nothing() -> None:
    """The launch ends at once, although the node still works."""

    async def scene(stage: Stage) -> None:
        await stage.enter_as(Managed, "managed")
        async with client_on("launch") as said:
            first, second = said.request(1), said.request("cleanup", "/nowhere")
            await asyncio.sleep(TRANSITION_SEC / 2)
            said.client.cancel(first)
            said.client.cancel(first)
            began = stage.loop.time()
        assert stage.loop.time() - began < 1
        said.client.cancel(second)
        assert not said.answers

    play(scene)


def test_only_so_many_nodes_are_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that was watched first is forgotten; one that is watched again stays."""
    monkeypatch.setattr(transition_client, "MAX_PROCESSES", 1)

    async def scene(stage: Stage) -> None:
        for name in ("managed", "other"):
            await stage.enter_as(Managed, name)
        async with client_on("launch") as said:
            said.client.watch(spec("again-2", node="/managed"))
            said.request("configure")
            await stage.until(partial(said.has, 1))
            assert {each.partition(" ")[0] for each in said.events} == {"again-2"}
            said.events.clear()
            said.client.watch(spec("other-3", node="/other"))
            said.request("activate")
            said.request("configure", "/other")
            await stage.until(partial(said.has, 3))
            assert {each.partition(" ")[0] for each in said.events} == {"other-3"}

    play(scene)


async def test_a_broker_that_refuses_the_client_fails_requests(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """If the broker refuses the client, requests fail at once with the reason; the launch goes on."""
    await meeting.node("_launch_1_lifecycle")
    async with client_on("launch", meeting.url) as said:
        said.request(1)
        await until(lambda: said.answers)
        ((_, failure),) = said.answers
        assert failure
        assert "_launch_1_lifecycle" in failure
    assert "cannot watch lifecycle nodes" in caplog.text
