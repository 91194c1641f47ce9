"""The supervisor with children in its own process, on a virtual clock: restarts, stopping, watching."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import Child, ChildEventKind, ChildState, Restart, Strategy, Supervisor
from tests.seams.limits import set_limits
from tests.seams.processes import lost_events
from tests.simulation.loop import simulate
from tests.simulation.stage import play

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors import ChildEvent
    from tests.simulation.loop import SimulatedLoop
    from tests.simulation.stage import Stage

STARTED, ENDED = ChildEventKind.STARTED, ChildEventKind.ENDED
RESTARTING, GIVEN_UP = ChildEventKind.RESTARTING, ChildEventKind.GIVEN_UP


class Diary:
    """Children that write down when they begin and end, and follow instructions."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.orders: dict[str, asyncio.Queue[Exception | None]] = {}

    def child(self, name: str, **options: Any) -> Child:
        """Return a child that runs until it gets an order: an exception to raise, or None to return."""
        self.orders[name] = asyncio.Queue()

        async def live() -> None:
            self.lines.append(f"{name} begins")
            try:
                order = await self.orders[name].get()
                if order is not None:
                    raise order
            finally:
                self.lines.append(f"{name} ends")

        return Child(name, node=live, **options)

    def order(self, name: str, what: Exception | None) -> None:
        """Give a child an order."""
        self.orders[name].put_nowait(what)

    def take(self) -> list[str]:
        """Return what was written since the last time."""
        lines, self.lines = self.lines, []
        return lines


def alone(scene: Callable[[SimulatedLoop, Diary], Coroutine[Any, Any, None]]) -> None:
    """Play a scene in virtual time; no task may be left."""

    async def main(loop: SimulatedLoop) -> None:
        await scene(loop, Diary())
        assert asyncio.all_tasks() == {asyncio.current_task()}

    simulate(main)


def test_children_start_in_order_and_stop_in_reverse() -> None:
    """Leaving the block stops the last one first."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async with Supervisor([diary.child(name) for name in "abc"]) as supervisor:
            assert await supervisor.wait_for("c", ChildState.RUNNING)
            assert diary.take() == ["a begins", "b begins", "c begins"]
        assert diary.take() == ["c ends", "b ends", "a ends"]
        assert [child.state for child in supervisor.children()] == [ChildState.ENDED] * 3

    alone(scene)


@pytest.mark.parametrize(
    ("strategy", "lines"),
    [
        (Strategy.ONE_FOR_ONE, ["b ends", "b begins"]),
        (Strategy.REST_FOR_ONE, ["b ends", "c ends", "b begins", "c begins"]),
        (Strategy.ONE_FOR_ALL, ["b ends", "c ends", "a ends", "a begins", "b begins", "c begins"]),
    ],
)
def test_what_a_death_means_for_the_others(strategy: Strategy, lines: list[str]) -> None:
    """Each strategy restarts exactly those that it should, in order."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        children = [diary.child(name) for name in "abc"]
        async with Supervisor(children, strategy=strategy, jitter=lambda: 1.0) as supervisor:
            await supervisor.wait_for("c", ChildState.RUNNING)
            diary.take()
            began = loop.time()
            diary.order("b", ValueError("no map"))
            await supervisor.wait_for("b", ChildState.WAITING)
            for name in "bc":
                await supervisor.wait_for(name, ChildState.RUNNING)
            assert loop.time() - began == pytest.approx(0.1)
            await asyncio.sleep(1)
            assert diary.take() == lines
            b = supervisor.children()[1]
            assert b.restarts == 1
            assert b.uptime_sec == pytest.approx(1.0)
            assert b.outcome is not None
            assert b.outcome.reason == "ValueError: no map"

    alone(scene)


def test_it_runs_until_all_have_ended_for_good() -> None:
    """run() returns when a transient and a temporary child have returned."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        children = [
            diary.child("a", restart=Restart.TRANSIENT),
            diary.child("b", restart=Restart.TEMPORARY),
        ]
        run = asyncio.create_task(Supervisor(children).run())
        diary.order("b", ValueError())
        await asyncio.sleep(10)
        assert not run.done()
        diary.order("a", None)
        await run
        assert diary.take() == ["a begins", "b begins", "b ends", "a ends"]

    alone(scene)


def test_no_children_is_the_end_at_once() -> None:
    """A supervisor without children has nothing to wait for."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        await Supervisor([]).run()
        assert loop.time() == 0

    alone(scene)


def test_too_many_deaths_end_everything() -> None:
    """The supervisor stops the others and raises, naming the child and its last reason."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async def broken() -> None:
            raise LookupError("no such port")

        supervisor = Supervisor([diary.child("a"), Child("b", node=broken), diary.child("c")])
        events = supervisor.events()
        with pytest.raises(actors.SupervisorGaveUp) as caught:
            await supervisor.run()
        assert str(caught.value).endswith("gave up: 'b' died too often, last: LookupError: no such port")
        assert isinstance(caught.value.__cause__, LookupError)
        assert (caught.value.supervisor, caught.value.child) == ("supervisor", "b")
        assert diary.take() == ["a begins", "c begins", "c ends", "a ends"]
        kinds = [event.kind for event in [each async for each in events] if event.child == "b"]
        assert kinds == [STARTED, ENDED, RESTARTING] * 3 + [STARTED, ENDED, GIVEN_UP]

    alone(scene)


def test_the_former_name_of_the_window_warns() -> None:
    """And its value counts."""
    with (
        pytest.warns(DeprecationWarning, match="`max_seconds=` is called `restart_window_sec=`") as caught,
        pytest.raises(ValueError, match="restart_window_sec must be more than 0"),
    ):
        Supervisor([], max_seconds=0)
    assert caught[0].filename == __file__


def test_giving_up_ends_the_block() -> None:
    """Whoever is inside `async with` is interrupted, and gets the error at the end of the block."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async def inside() -> None:
            async with Supervisor([diary.child("a")], max_restarts=0):
                diary.order("a", ValueError())
                await asyncio.Event().wait()

        with pytest.raises(actors.SupervisorGaveUp):
            await inside()
        task = asyncio.current_task()
        assert task is not None
        assert task.cancelling() == 0

    alone(scene)


def test_an_error_in_the_block_stops_the_children_and_comes_through() -> None:
    """The block's own error is not hidden."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async def inside() -> None:
            async with Supervisor([diary.child("a")]):
                await asyncio.sleep(1)
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            await inside()
        assert diary.take() == ["a begins", "a ends"]

    alone(scene)


def test_cancellation_stops_all_and_leaves_nothing() -> None:
    """A cancelled run() stops its children in reverse order; also one that waits for its restart."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        run = asyncio.create_task(Supervisor([diary.child(name) for name in "ab"]).run())
        await asyncio.sleep(1)
        diary.order("a", ValueError())
        await asyncio.sleep(0.01)
        run.cancel()
        with pytest.raises(asyncio.CancelledError):
            await run
        assert diary.take() == ["a begins", "b begins", "a ends", "b ends"]
        await asyncio.sleep(10)
        assert diary.take() == []

    alone(scene)


def stubborn(name: str, seconds: float, **options: Any) -> Child:
    """Return a child that takes no notice of being cancelled for so long."""

    async def live() -> None:
        loop = asyncio.get_running_loop()
        end = None
        while end is None or loop.time() < end:
            try:
                await asyncio.sleep(100 if end is None else end - loop.time())
            except asyncio.CancelledError:
                end = end or loop.time() + seconds

    return Child(name, node=live, **options)


@pytest.mark.parametrize(("seconds", "takes"), [(3, 3), (5.5, 5.5), (60, 7)])
def test_stopping_is_bounded(seconds: float, takes: float, caplog: pytest.LogCaptureFixture) -> None:
    """A child that ignores its cancellation is cancelled again after 5 s, and given up 2 s later."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async with Supervisor([stubborn("rock", seconds)]) as supervisor:
            await supervisor.wait_for("rock", ChildState.RUNNING)
            began = loop.time()
        assert loop.time() - began == pytest.approx(takes)
        assert ("cannot be stopped" in caplog.text) is (seconds == 60)
        await asyncio.sleep(seconds)

    alone(scene)


def test_a_second_cancellation_forces_the_stop() -> None:
    """It bounds the rest of the stop by 2 s, whatever the children's timeouts."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        rocks = [stubborn(name, 10, stop_timeout_sec=30) for name in "abc"]
        run = asyncio.create_task(Supervisor(rocks).run())
        await asyncio.sleep(1)
        run.cancel()
        await asyncio.sleep(1)
        run.cancel()
        await asyncio.wait({run})
        assert loop.time() == pytest.approx(4)
        assert run.cancelled()
        await asyncio.sleep(20)

    alone(scene)


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("levels", [0, 1, 2])
def test_a_second_cancellation_reaches_everything(levels: int, *, told: bool) -> None:
    """A task that ends only at the second one ends at once, also below supervisors, stopped before or not."""

    def below(child: Child, number: int) -> Child:
        def make() -> Supervisor:
            return Supervisor([child], name=f"level {number}")

        return child if number == 0 else below(Child(f"level {number}", node=make), number - 1)

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        cancellations: list[float] = []

        async def deaf() -> None:
            while len(cancellations) < 2:
                try:
                    await asyncio.Event().wait()
                except asyncio.CancelledError:
                    cancellations.append(loop.time())

        rock = stubborn("rock", 1.5, stop_timeout_sec=30)
        nested = below(Child("deaf", node=deaf, stop_timeout_sec=30), levels)
        supervisor = Supervisor([rock, nested] if told else [nested, rock])
        run = asyncio.create_task(supervisor.run())
        await asyncio.sleep(1)
        run.cancel()
        await asyncio.sleep(1)
        run.cancel()
        await asyncio.wait({run})
        assert cancellations == pytest.approx([1 if told else 2, 2])
        statuses = {child.name: child for child in supervisor.children()}
        outcome = statuses[nested.name].outcome
        assert isinstance(outcome, actors.Outcome)
        assert (outcome.normal, outcome.reason) == (True, "stopped by its supervisor")

    alone(scene)


def test_a_supervisor_can_be_a_child() -> None:
    """When the inner one gives up, the outer one starts a new one."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        leaf = diary.child("leaf")
        inner = Child("inner", node=lambda: Supervisor([leaf], max_restarts=0, name="inner"))
        async with Supervisor([inner]) as outer:
            await asyncio.sleep(1)
            diary.order("leaf", ValueError("broken"))
            await asyncio.sleep(1)
            assert diary.take() == ["leaf begins", "leaf ends", "leaf begins"]
            (status,) = outer.children()
            assert status.restarts == 1
            assert status.outcome is not None
            assert "gave up: 'leaf' died too often, last: ValueError: broken" in status.outcome.reason
        assert diary.take() == ["leaf ends"]

    alone(scene)


def test_a_factory_that_raises_or_gives_nonsense_is_a_death() -> None:
    """A child that dies while it starts counts as any other, whatever it raises."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        def broken() -> actors.Node:
            raise OSError("no device")

        class MuteError(Exception):
            def __str__(self) -> str:
                raise RuntimeError("no text")

        def mute() -> actors.Node:
            raise MuteError

        for factory, reason in (
            (broken, "OSError: no device"),
            (mute, "MuteError: .* without a readable text"),
            (lambda: 5, "TypeError: .* returned 5"),
        ):
            child = Child("c", node=factory)  # type: ignore[arg-type]
            with pytest.raises(actors.SupervisorGaveUp, match=reason):
                await Supervisor([child], max_restarts=1).run()

    alone(scene)


def test_it_runs_once() -> None:
    """A second run is refused."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        supervisor = Supervisor([])
        await supervisor.run()
        with pytest.raises(RuntimeError, match="has run already"):
            await supervisor.run()

    alone(scene)


def test_a_failing_supervisor_stops_its_children() -> None:
    """An error of the supervisor itself (here: of the jitter that it was given) stops all, and is raised."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        def jitter() -> float:
            raise ZeroDivisionError

        async def inside() -> None:
            async with Supervisor([diary.child("a"), diary.child("b")], jitter=jitter) as supervisor:
                await supervisor.wait_for("b", ChildState.RUNNING)
                diary.order("a", ValueError())
                await asyncio.Event().wait()

        with pytest.raises(ZeroDivisionError):
            await inside()
        assert diary.take() == ["a begins", "b begins", "a ends", "b ends"]

    alone(scene)


def test_waiting_for_a_state() -> None:
    """True when it comes, False at the supervisor's end, WaitTimeout; an unknown name is refused."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        supervisor = Supervisor([diary.child("a", restart=Restart.TRANSIENT)])
        early = asyncio.create_task(supervisor.wait_for("a", ChildState.RUNNING))
        with pytest.raises(ValueError, match="No child 'b'; there is: a"):
            await supervisor.wait_for("b", ChildState.RUNNING)
        async with supervisor:
            assert await early
            with pytest.raises(actors.WaitTimeout, match="'a' was not ENDED within 2 s"):
                await supervisor.wait_for("a", ChildState.ENDED, 2.0)
            assert loop.time() == pytest.approx(2)
            never = asyncio.create_task(supervisor.wait_for("a", ChildState.WAITING))
            await asyncio.sleep(1)
            diary.order("a", None)
            assert await supervisor.wait_for("a", ChildState.ENDED)
        assert not await never
        assert not await supervisor.wait_for("a", ChildState.RUNNING)
        assert await supervisor.wait_for("a", ChildState.ENDED)

    alone(scene)


def test_watchers_see_what_happens() -> None:
    """Each gets every event from its making on, with the reason, and ends with the supervisor."""

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        supervisor = Supervisor([diary.child("a")], name="boss", jitter=lambda: 1.0)
        early = supervisor.events()
        assert isinstance(early, actors.ChildEvents)
        async with supervisor:
            await supervisor.wait_for("a", ChildState.RUNNING)
            late = supervisor.events()
            diary.order("a", ValueError("no map"))
            await asyncio.sleep(1)
        seen = [(event.kind, event.reason, event.restarts) async for event in early]
        assert seen == [
            (STARTED, "", 0),
            (ENDED, "ValueError: no map", 0),
            (RESTARTING, "ValueError: no map", 0),
            (STARTED, "", 1),
            (ENDED, "stopped by its supervisor", 1),
        ]
        rest = [event async for event in late]
        assert [event.kind for event in rest] == [kind for kind, *_ in seen[1:]]
        assert rest[1].delay_sec == pytest.approx(0.1)
        assert {(event.supervisor, event.child, event.pid) for event in rest} == {("boss", "a", None)}
        assert [event async for event in supervisor.events()] == []
        assert early.dropped == late.dropped == 0

    alone(scene)


def test_a_slow_watcher_misses_the_oldest_and_counts_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A watcher's queue is bounded; what it cannot hold is dropped, oldest first."""
    limit = 20
    set_limits(monkeypatch, child_events=limit)

    async def scene(loop: SimulatedLoop, diary: Diary) -> None:
        async def short() -> None:
            """Return at once."""

        children = [Child(f"c{i}", node=short, restart=Restart.TEMPORARY) for i in range(limit)]
        supervisor = Supervisor(children)
        watcher = supervisor.events()
        await supervisor.run()
        seen = [event async for event in watcher]
        assert len(seen) == watcher.dropped == limit
        assert seen[-1].child == f"c{limit - 1}"

    alone(scene)


def test_nodes_are_children() -> None:
    """A node class is started anew when it fails; the graph shows one node, and none in the end."""

    async def scene(stage: Stage) -> None:
        class Worker(actors.Node):
            def __init__(self) -> None:
                super().__init__("worker", use_global_arguments=False, on_error="stop")
                made.append(self)
                self.create_timer(1.0, self.fail, autostart=len(made) == 1)

            def fail(self) -> None:
                raise ValueError("worn out")

        made: list[actors.Node] = []
        watcher = await stage.enter("watcher")
        async with Supervisor([Child("worker", node=Worker)]) as supervisor:
            await asyncio.sleep(3)
            (status,) = supervisor.children()
            assert (status.state, status.restarts, len(made)) == (ChildState.RUNNING, 1, 2)
            assert status.outcome is not None
            assert status.outcome.reason == "ValueError: worn out"
            assert sorted(await watcher.get_node_names()) == ["watcher", "worker"]
        await asyncio.sleep(1)
        assert await watcher.get_node_names() == ["watcher"]

    play(scene)


def test_events_are_published_for_other_processes() -> None:
    """Any node can subscribe to ~/child_events, and gets what was before, too."""

    async def scene(stage: Stage) -> None:
        diary = Diary()
        boss = await stage.enter("boss")
        async with Supervisor([diary.child("a")], node=boss, max_restarts=0) as supervisor:
            await supervisor.wait_for("a", ChildState.RUNNING)
        other = await stage.enter("other")
        latched = actors.QoSProfile(depth=100, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        seen: list[actors.ChildEventMessage] = []
        other.create_subscription(actors.ChildEventMessage, "/boss/child_events", seen.append, latched)
        await stage.until(lambda: len(seen) == 2)
        assert [(msg.supervisor, msg.child, msg.kind, msg.reason) for msg in seen] == [
            ("supervisor", "a", "started", ""),
            ("supervisor", "a", "ended", "stopped by its supervisor"),
        ]
        assert all(msg.stamp.sec > 0 for msg in seen)

    play(scene)


def test_a_reason_that_is_no_text_is_published(caplog: pytest.LogCaptureFixture) -> None:
    """What an exception says is made fit to be sent (here: half a pair, as in names of broken files)."""

    async def scene(stage: Stage) -> None:
        diary = Diary()
        boss = await stage.enter("boss")
        reasons: list[str] = []
        other = await stage.enter("other")
        other.create_subscription(
            actors.ChildEventMessage, "/boss/child_events", lambda msg: reasons.append(msg.reason), 10
        )
        async with Supervisor([diary.child("a")], node=boss) as supervisor:
            await supervisor.wait_for("a", ChildState.RUNNING)
            diary.order("a", OSError("no file \udcff"))
            await stage.until(lambda: "OSError: no file \\udcff" in reasons)
            await supervisor.wait_for("a", ChildState.RUNNING)
        assert lost_events(supervisor) == 0

    # The traceback is not made fit: no test report can hold it.
    with caplog.at_level(logging.CRITICAL, "callboard.supervisor"):
        play(scene)


def test_an_event_that_cannot_be_published_is_logged(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It disturbs nobody: the children are restarted all the same."""

    def message_of(event: ChildEvent) -> actors.ChildEventMessage:
        raise actors.InvalidMessageError(f"{event.child} is out of range")

    monkeypatch.setattr("actors.processes.event_publisher.message_of", message_of)

    async def scene(stage: Stage) -> None:
        diary = Diary()
        boss = await stage.enter("boss")
        async with Supervisor([diary.child("a")], node=boss) as supervisor:
            await supervisor.wait_for("a", ChildState.RUNNING)
            diary.order("a", ValueError())
            await asyncio.sleep(1)
            assert diary.take() == ["a begins", "a ends", "a begins"]
        assert lost_events(supervisor) == 5
        assert "Lost child event number 1, it cannot be published: a is out of range" in caplog.text

    play(scene)


def test_a_destroyed_node_does_not_disturb_supervision() -> None:
    """The node that publishes may end before: the children are restarted all the same."""

    async def scene(stage: Stage) -> None:
        diary = Diary()
        boss = await stage.enter("boss")
        async with Supervisor([diary.child("a")], node=boss) as supervisor:
            await supervisor.wait_for("a", ChildState.RUNNING)
            boss.destroy_node()
            diary.order("a", ValueError())
            await asyncio.sleep(1)
            assert diary.take() == ["a begins", "a ends", "a begins"]

    play(scene)
