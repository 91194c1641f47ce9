"""What a launch does next: no process runs here, and time is a number."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.process_actions import OutputMode
from actors.launch.engine.effects import CallFunction, ForceStopAll, Notify, Run, Stop, StopAll
from actors.launch.engine.handlers import (
    ABANDONED,
    LINE_BYTES,
    MAX_HANDLERS,
    MAX_QUEUED_EVENTS,
    MAX_WAITING_BYTES,
    call_function,
)
from actors.launch.engine.machine import (
    LAST_FUNCTION_SEC,
    REMINDER_SEC,
    REPEATED_STOP_SEC,
    Machine,
)
from actors.launch.engine.process_table import ProcessState
from actors.launch.errors import LaunchError
from actors.launch.planning.events import (
    Appeared,
    Event,
    Level,
    Message,
    ProcessExited,
    ProcessIO,
    ProcessRestarts,
    ProcessStarted,
    ProcessWaits,
    ShuttingDown,
    Stream,
)
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.process_spec import MAX_PROCESSES, ProcessSpec
from actors.launch.planning.steps import AddHandler, Call, End, LogText, Start, awaits_graph
from actors.processes.outcome import Outcome, outcome_of_exit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.engine.effects import Effect
    from actors.launch.planning.steps import Step

TALKER = Presence(PresenceKind.NODE, "/talker")
ADD = Presence(PresenceKind.SERVICE, "/add")


def process(name: str = "a", **options: Any) -> ProcessSpec:
    """Return a process."""
    return ProcessSpec(label=f"{name}-1", name=name, command=(name,), shown=name, **options)


def start(name: str = "a", *, after_sec: float = 0.0, **options: Any) -> Start:
    """Return the step that starts a process."""
    on_exit = options.pop("on_exit", None)
    return Start(process=process(name, **options), on_exit=on_exit, after_sec=after_sec)


def whenever(kind: type[Event], *steps: Step, **options: Any) -> AddHandler:
    """Return the step that reacts to all events of a kind."""
    return AddHandler(
        what=kind.__name__,
        matches=lambda event: isinstance(event, kind),
        steps=lambda _event: list(steps),
        preview=steps,
        **options,
    )


class Play:
    """A machine, its time, and what it has wanted so far."""

    def __init__(self, *steps: Step, **options: Any) -> None:
        self.machine = Machine(**options)
        self.now = 100.0
        self.effects: list[Effect] = []
        self.asked: list[CallFunction] = []
        self.answers = True
        self.does(self.machine.begin, steps)

    def does(self, what: Callable[..., list[Effect]], *args: Any) -> list[Effect]:
        """Tell the machine something; return what it wants. Functions answer at once, if `answers` is set."""
        effects = what(*args, self.now)
        self.asked += [each for each in effects if isinstance(each, CallFunction)]
        self.effects += effects
        while self.answers and self.asked:
            effects = [*effects, *self.answer()]
        return effects

    def answer(self) -> list[Effect]:
        """Call the function that has been asked for first."""
        first = self.asked.pop(0)
        effects = self.machine.function_returned(first, call_function(first.call), self.now)
        self.asked += [each for each in effects if isinstance(each, CallFunction)]
        self.effects += effects
        return effects

    def up(self, label: str = "a-1") -> None:
        """A process runs."""
        self.does(self.machine.started, label, 7)

    def ends(self, label: str = "a-1", code: int = 0) -> list[Effect]:
        """A process ends."""
        return self.does(self.machine.ended, label, outcome_of_exit(code))

    def waits(self, seconds: float) -> list[Effect]:
        """Time passes, from one moment at which something is due to the next."""
        end = self.now + seconds
        effects: list[Effect] = []
        while (due := self.machine.wake_at) is not None and due <= end:
            self.now = max(due, self.now)
            effects += self.does(self.machine.tick)
        self.now = end
        return effects

    @property
    def runs(self) -> list[str]:
        """The labels of what has been started, in order."""
        return [each.process.label for each in self.effects if isinstance(each, Run)]

    def told(self, kind: type[Any]) -> list[Any]:
        """The events of a kind."""
        return [
            each.event for each in self.effects if isinstance(each, Notify) and isinstance(each.event, kind)
        ]

    @property
    def said(self) -> list[str]:
        """What was reported."""
        return [f"{each.level.value} {each.about}: {each.text}" for each in self.told(Message)]


def test_a_timer_may_survive_the_end_of_the_launch() -> None:
    """The launch goes on until it is due, and starts no process then; a second request to stop forgets it."""
    last = LogText(text="last", after_sec=5.0, cancel_on_shutdown=False)
    late = start("b", after_sec=6.0)
    steps = (start(), LogText(text="lost", after_sec=4.0), last, replace(late, cancel_on_shutdown=False))
    for insist in (False, True):
        play = Play(*steps)
        play.up()
        play.does(partial(play.machine.stop, "enough"))
        play.ends()
        assert not play.machine.finished
        if insist:
            play.waits(1.0)
            play.does(partial(play.machine.stop, "enough"))
        else:
            play.waits(6.0)
        assert play.machine.finished
        assert (play.said, play.runs) == ([] if insist else ["INFO launch: last"], ["a-1"])


def test_the_function_of_a_timer_that_survives_has_time_of_its_own() -> None:
    """However late it is called."""
    late = 2 * LAST_FUNCTION_SEC
    play = Play(
        start(),
        Call(name="f()", steps=lambda: [LogText(text="called")], after_sec=late, cancel_on_shutdown=False),
    )
    play.up()
    play.answers = False
    play.does(partial(play.machine.stop, "enough"))
    play.ends()
    play.waits(late + LAST_FUNCTION_SEC / 2)
    assert len(play.asked) == 1
    play.answer()
    assert (play.said, play.machine.finished) == (["INFO launch: called"], True)


def test_steps_are_taken_in_order_when_they_are_due() -> None:
    """Those for later in their time; the launch is over when nothing runs and nothing is to come."""
    play = Play(start("a"), start("b", after_sec=2), LogText(text="hello", after_sec=1))
    assert play.runs == ["a-1"]
    play.up()
    play.ends()
    assert not play.machine.finished
    play.waits(1)
    assert play.said == ["INFO launch: hello"]
    play.waits(1)
    assert play.runs == ["a-1", "b-1"]
    assert not play.machine.finished
    play.ends("b-1")
    assert play.machine.finished
    assert not play.machine.failed


def test_nothing_to_do_is_over_at_once() -> None:
    """A description of nothing ends."""
    assert Play().machine.finished
    assert not Play(keep=True).machine.finished


def test_what_happens_is_reported() -> None:
    """With the process it is about; its number is known from its start to its end."""
    play = Play(start())
    play.up()
    play.does(play.machine.wrote, "a-1", Stream.OUTPUT, [b"x", b"y"])
    play.ends(code=-9)
    (started,), (written,), (ended,) = map(play.told, (ProcessStarted, ProcessIO, ProcessExited))
    assert (started.process_name, started.pid) == ("a-1", 7)
    assert (written.text, written.from_stdout, written.from_stderr) == (b"x\ny\n", True, True)
    assert (ended.pid, ended.returncode, ended.outcome.signal_name) == (7, -9, "SIGKILL")


# Restarting


def test_a_respawn_backs_off() -> None:
    """Each delay is longer, up to the longest; a process that has lived long begins anew."""
    play = Play(
        start(respawn=True, respawn_delay_sec=0.5, respawn_backoff=2.0, respawn_max_delay_sec=3.0),
    )
    for delay in (0.5, 1.0, 2.0, 3.0, 3.0):
        play.ends(code=1)
        assert play.told(ProcessRestarts)[-1].delay_sec == delay
        assert play.machine.state("a-1") is ProcessState.RESTARTING
        assert not play.machine.finished
        before = len(play.runs)
        play.waits(delay)
        assert len(play.runs) == before + 1
    play.waits(6.0)
    play.ends(code=1)
    assert play.told(ProcessRestarts)[-1].delay_sec == 0.5


def test_a_respawn_ends_when_its_retries_do() -> None:
    """Two retries are three ends, and the launch is over."""
    play = Play(start(respawn=True, respawn_max_retries=2))
    for _ in range(2):
        play.ends()
        play.waits(1)
    assert not play.machine.finished
    play.ends()
    assert play.machine.finished
    assert len(play.told(ProcessExited)) == 3


def test_a_shutdown_comes_before_a_respawn() -> None:
    """With a delay of 2 s and the end after 3 s, a program that ends at once has ended twice."""
    play = Play(
        start(respawn=True, respawn_delay_sec=2.0, respawn_max_delay_sec=2.0), End(reason="x", after_sec=3)
    )
    play.ends()
    play.waits(2)
    play.ends()
    play.waits(1)
    assert len(play.told(ProcessExited)) == 2
    assert play.machine.finished


def test_a_process_is_restarted_on_demand() -> None:
    """Stopped, and started when it has ended; with no delay, and without counting as a respawn."""
    play = Play(start(required=True))
    play.up()
    assert play.does(play.machine.restart, "a-1", "changed")[-1] == Stop("a-1")
    assert play.does(play.machine.restart, "a-1", "changed again") == []
    play.ends(code=-2)
    assert play.runs == ["a-1", "a-1"]
    assert not play.machine.stopping


@pytest.mark.parametrize("respawn", [False, True])
def test_a_dead_process_is_restarted_on_demand(*, respawn: bool) -> None:
    """One that has ended, or that waits for its time; that time does not start it again."""
    play = Play(start(respawn=respawn, respawn_delay_sec=5.0, respawn_max_delay_sec=5.0), keep=True)
    play.ends(code=1)
    assert not play.machine.finished
    play.does(play.machine.restart, "a-1", "changed")
    play.waits(10)
    assert play.runs == ["a-1", "a-1"]


def test_an_unknown_process_is_not_restarted() -> None:
    """Nor one while the launch ends."""
    play = Play(start())
    assert play.does(play.machine.restart, "b-1", "changed") == []
    play.does(play.machine.stop, "enough")
    assert play.does(play.machine.restart, "a-1", "changed") == []


# Waiting


def test_a_process_waits_for_what_it_depends_on() -> None:
    """For all of it; what else changes in the graph does not start it."""
    play = Play(start(depends_on=(TALKER, ADD)))
    assert play.runs == []
    (waits,) = play.told(ProcessWaits)
    assert (waits.missing, waits.so_far_sec) == ((TALKER, ADD), 0.0)
    play.does(play.machine.graph, frozenset({TALKER}))
    assert play.runs == []
    play.does(play.machine.graph, frozenset({ADD}))
    assert play.runs == []
    assert not play.machine.finished
    play.does(play.machine.graph, frozenset({TALKER, ADD}))
    assert play.runs == ["a-1"]
    play.waits(1000)
    assert play.machine.state("a-1") is ProcessState.UP


def test_what_is_there_already_is_not_waited_for() -> None:
    """A process that is started later sees what the graph has then."""
    play = Play(start(after_sec=1, depends_on=(ADD,)))
    play.does(play.machine.graph, frozenset({ADD}))
    play.waits(1)
    assert play.runs == ["a-1"]
    assert play.told(ProcessWaits) == []


def test_a_wait_has_an_end() -> None:
    """It is reported again and again, and then the process counts as dead: a required one ends the launch."""
    play = Play(start(depends_on=(ADD,), depends_timeout_sec=5 * REMINDER_SEC, required=True))
    play.waits(9 * REMINDER_SEC)
    assert [each.so_far_sec for each in play.told(ProcessWaits)] == [0.0, 10.0, 20.0, 40.0]
    (ended,) = play.told(ProcessExited)
    assert ended.outcome.reason == "service /add was not there within 50 s"
    assert not ended.outcome.normal
    assert play.machine.failed
    assert play.machine.finished
    assert play.runs == []


def test_a_wait_can_be_for_ever() -> None:
    """If the description says so."""
    play = Play(start(depends_on=(ADD,), depends_timeout_sec=float("inf")))
    play.waits(1e9)
    assert not play.machine.finished


def test_what_comes_back_waits_again() -> None:
    """A respawn depends on the same things; what has gone meanwhile is waited for."""
    play = Play(start(depends_on=(ADD,), respawn=True))
    play.does(play.machine.graph, frozenset({ADD}))
    play.does(play.machine.graph, frozenset())
    play.ends(code=1)
    play.waits(1)
    assert play.runs == ["a-1"]
    play.does(play.machine.graph, frozenset({ADD}))
    assert play.runs == ["a-1", "a-1"]


def test_a_waiting_process_does_not_hold_the_end_up() -> None:
    """It is just not started."""
    play = Play(start(depends_on=(ADD,)))
    play.does(play.machine.stop, "enough")
    assert play.machine.finished
    play.does(play.machine.graph, frozenset({ADD}))
    assert play.runs == []


@pytest.mark.parametrize("respawn", [False, True])
def test_a_handler_may_start_its_own_process_again(*, respawn: bool) -> None:
    """That is one start, also for one that would come back by itself, and can go on for ever."""
    again = start("a", respawn=respawn)
    play = Play(again, whenever(ProcessExited, again))
    for count in range(2, 5):
        play.ends()
        play.waits(10)
        assert play.runs == ["a-1"] * count
    assert play.machine.state("a-1") is ProcessState.UP


def test_a_required_process_that_a_handler_has_started_again_is_not_the_end() -> None:
    """The handler knows better."""
    again = start("a", required=True)
    play = Play(again, whenever(ProcessExited, again, once=True))
    play.ends(code=1)
    assert not play.machine.stopping
    play.ends(code=1)
    assert play.machine.failed


# Reacting


def test_on_exit_is_done_whenever_its_process_ends() -> None:
    """And for no other; what it starts in place of a dead process is not mixed up with that."""
    play = Play(start("a", on_exit=whenever(Event, LogText(text="bye"), start("b"))))
    play.ends("a-1", 1)
    play.ends("b-1")
    assert play.said == ["INFO launch: bye"]
    assert play.runs == ["a-1", "b-1"]


def test_processes_that_come_and_go_leave_nothing_behind() -> None:
    """Each has a successor with an `on_exit` of its own, for as long as it likes."""
    count = 0

    def successor(event: Event) -> list[Step]:
        nonlocal count
        count += 1
        made = AddHandler(what="x", matches=lambda event: True, steps=successor)
        return [start(f"p{count}", on_exit=made, made_later=True)]

    play = Play(
        start("p0", on_exit=AddHandler(what="x", matches=lambda event: True, steps=successor)), keep=True
    )
    for number in range(2 * MAX_HANDLERS):
        play.ends(f"p{number}-1")
        play.effects.clear()
    assert not play.machine.failed
    assert play.does(play.machine.restart, "p5-1", "changed") == []


def test_a_handler_reacts_each_time() -> None:
    """What it starts waits its time, counted from then; handlers that stand behind a process miss nothing."""
    play = Play(
        start(respawn=True),
        whenever(ProcessExited, LogText(text="gone"), LogText(text="long gone", after_sec=1)),
    )
    play.ends()
    assert play.said == ["INFO launch: gone"]
    play.waits(0.5)
    play.ends()
    play.waits(1.0)
    assert [each.rpartition(" ")[2] for each in play.said] == ["gone", "gone", "gone", "gone"]
    assert play.said.count("INFO launch: long gone") == 2


def test_a_handler_can_react_once() -> None:
    """And never again."""
    play = Play(start(respawn=True), whenever(ProcessExited, LogText(text="gone"), once=True))
    play.ends()
    play.waits(1)
    play.ends()
    assert play.said == ["INFO launch: gone"]


def test_what_a_handler_starts_runs_once_at_a_time() -> None:
    """A second start while it runs is refused, and said; when it has ended it is started again."""
    play = Play(start("a", respawn=True), whenever(ProcessExited, start("b"), once=False))
    play.ends("a-1")
    assert play.runs == ["a-1", "b-1"]
    play.waits(1)
    play.ends("a-1")
    assert play.said == ["WARN b-1: runs already; it is not started a second time"]
    play.ends("b-1")
    assert play.runs.count("b-1") == 2


def test_what_appears_is_reacted_to() -> None:
    """At once if it is there when the handler comes; again when it has been away."""
    there = AddHandler(
        what="x",
        matches=lambda event: isinstance(event, Appeared) and event.presence == ADD,
        steps=lambda _event: [LogText(text="there")],
        presence=ADD,
    )
    play = Play(there, Call(name="f()", steps=lambda: [there], after_sec=1), start())
    play.does(play.machine.graph, frozenset({TALKER, ADD}))
    assert play.said == ["INFO launch: there"]
    play.waits(1)
    assert len(play.said) == 2
    play.does(play.machine.graph, frozenset())
    play.does(play.machine.graph, frozenset({ADD}))
    assert len(play.said) == 4
    assert [each.presence for each in play.told(Appeared)] == [TALKER, ADD, ADD]


def test_a_function_that_fails_ends_the_launch() -> None:
    """What it raises is reported, and the launch has failed."""

    def fail() -> list[Step]:
        raise LaunchError("f(): ValueError: no")

    play = Play(start(), Call(name="f()", steps=fail, after_sec=1))
    play.up()
    effects = play.waits(1)
    assert play.said == ["ERROR launch: f(): ValueError: no"]
    assert effects[-1] == StopAll()
    assert play.machine.failed


def test_a_handler_that_has_failed_is_not_called_again() -> None:
    """Its mistake is reported once, though what it is for goes on happening while the launch ends."""

    def fail(event: Event) -> list[Step]:
        raise LaunchError("no")

    play = Play(
        start(),
        AddHandler(what="x", matches=lambda event: isinstance(event, ProcessIO), steps=fail, calls=True),
    )
    play.up()
    for _ in range(3):
        play.does(play.machine.wrote, "a-1", Stream.OUTPUT, [b"x"])
    assert play.said == ["ERROR launch: no"]


def function(text: str, *steps: Step, kind: type[Event] = ProcessExited) -> AddHandler:
    """Return a handler with a function, which says something and gives steps."""
    return AddHandler(
        what="x",
        matches=lambda event: isinstance(event, kind),
        steps=lambda _event: [LogText(text=text), *steps],
        calls=True,
    )


def test_reactions_wait_for_functions_in_order() -> None:
    """What happens while a function runs is reported at once and reacted to later, as if it took no time."""
    play = Play(
        start("a", respawn=True), start("b"), function("first"), whenever(ProcessExited, LogText(text="x"))
    )
    play.answers = False
    play.ends("a-1")
    play.ends("b-1", 3)
    assert len(play.told(ProcessExited)) == 2
    assert (play.said, len(play.asked)) == ([], 1)
    assert play.told(ProcessRestarts) == []
    play.answer()
    assert play.said == ["INFO launch: first", "INFO launch: x"]
    assert len(play.told(ProcessRestarts)) == 1
    play.answer()
    assert play.said == ["INFO launch: first", "INFO launch: x"] * 2
    assert not play.asked


def test_a_launch_goes_on_for_a_function_that_runs() -> None:
    """It may start something, though nothing else is left to run."""
    play = Play(start("a"), function("more", start("b")))
    play.answers = False
    play.ends("a-1")
    assert not play.machine.stopping
    play.answer()
    assert play.runs == ["a-1", "b-1"]


@pytest.mark.parametrize("forced", [False, True])
def test_functions_do_not_hold_the_end_up_for_long(*, forced: bool) -> None:
    """When the launch ends, a function has some seconds; a second Ctrl-C ends the wait and is reported."""
    play = Play(start("a"), function("late", start("b")), function("never", kind=ShuttingDown))
    play.answers = False
    play.ends("a-1")
    play.does(play.machine.stop, "interrupted")
    assert not play.machine.finished
    if forced:
        play.waits(REPEATED_STOP_SEC)
        play.does(play.machine.stop, "interrupted")
    else:
        play.waits(LAST_FUNCTION_SEC)
    assert play.machine.finished
    assert play.said == [f"WARN launch: {ABANDONED}"]
    play.answer()
    assert (play.runs, play.said) == (["a-1"], [f"WARN launch: {ABANDONED}"])


def test_what_waits_for_a_slow_function_has_a_limit() -> None:
    """A process that writes much meanwhile is reported; what is not reacted to is counted."""
    play = Play(start("a"), start("b"), function("late"), whenever(ProcessIO))
    play.answers = False
    play.ends("a-1")
    for _ in range(MAX_QUEUED_EVENTS + 5):
        play.does(play.machine.wrote, "b-1", Stream.OUTPUT, [b"x"])
    assert len(play.told(ProcessIO)) == MAX_QUEUED_EVENTS + 5
    play.answer()
    assert play.said[-1].startswith("WARN launch: 5 events were not handled: functions")


def test_output_that_waits_for_a_slow_function_has_a_limit() -> None:
    """In bytes, too, as events may have many lines; once they have been handled there is space again."""
    play = Play(start("a"), start("b"), start("c"), function("late"), whenever(ProcessIO))
    play.answers = False
    line = b"x" * (MAX_WAITING_BYTES // 2 - LINE_BYTES)
    for label in ("a-1", "b-1"):
        play.ends(label)
        for each in (line, line, b""):
            play.does(play.machine.wrote, "c-1", Stream.OUTPUT, [each])
        play.answer()
        assert play.said[-1].startswith("WARN launch: 1 events were not handled: functions")


def test_streams_are_split_when_somebody_must_know() -> None:
    """A handler for one of them, or an output that goes different ways."""
    play = Play(start("a"), start("b", output=OutputMode.LOG), start("c", output=OutputMode.BOTH))
    assert [each.split for each in play.effects if isinstance(each, Run)] == [False, True, False]
    play = Play(start("a"), whenever(ProcessIO, split=True))
    assert [each.split for each in play.effects if isinstance(each, Run)] == [True]


def test_handlers_have_a_limit() -> None:
    """A description that makes ever more of them is wrong."""
    play = Play(*(whenever(ProcessIO) for _ in range(MAX_HANDLERS)))
    assert not play.machine.failed
    play = Play(*(whenever(ProcessIO) for _ in range(MAX_HANDLERS + 1)))
    assert play.machine.failed


def test_processes_have_a_limit() -> None:
    """Of those that live; the dead make room, also where they are kept."""
    many = [start(f"p{number}") for number in range(MAX_PROCESSES)]
    one_more = Call(name="f()", steps=lambda: [start("more")], after_sec=1)
    play = Play(*many, one_more)
    play.waits(1)
    assert play.said == [f"ERROR launch: More than {MAX_PROCESSES} processes would run"]
    play = Play(*many, one_more, keep=True)
    play.ends("p5-1")
    play.waits(1)
    assert play.runs[-1] == "more-1"
    assert not play.machine.failed


def test_a_warning_reports_a_handler_that_comes_too_late() -> None:
    """The streams of what runs already cannot be told apart any more; those of what comes are."""
    late = whenever(ProcessIO, split=True)
    play = Play(start("a"), Call(name="f()", steps=lambda: [late, late, start("b")], after_sec=1))
    play.waits(1)
    (said,) = play.said
    assert said.startswith("WARN a-1: stdout and stderr share one stream here")
    assert [each.split for each in play.effects if isinstance(each, Run)] == [False, True]
    before = Play(start("a"), whenever(ProcessExited, whenever(ProcessIO, split=True)))
    assert [each.split for each in before.effects if isinstance(each, Run)] == [True]


# Ending


def test_the_end_of_the_last_process_is_the_launchs() -> None:
    """It is reported as ShuttingDown, and handlers react to it, as with any other end."""
    play = Play(start(), whenever(ShuttingDown, LogText(text="bye")))
    play.ends()
    assert play.told(ShuttingDown) == [ShuttingDown("nothing is left to run")]
    assert play.said == ["INFO launch: bye"]
    assert play.machine.finished


def test_a_stop_that_does_not_insist_forces_nothing() -> None:
    """Nobody reads any more, or the terminal is gone: that is no second Ctrl-C."""
    play = Play(start())
    play.does(play.machine.stop, "interrupted")
    play.waits(10 * REPEATED_STOP_SEC)
    assert play.machine.stop("nobody reads the output", play.now, escalate=False) == []


def test_a_restart_gives_new_retries() -> None:
    """What has been mended may die as often as before."""
    play = Play(start(respawn=True, respawn_max_retries=1), keep=True)
    for _ in range(2):
        play.ends(code=1)
        play.waits(1)
    assert play.runs == ["a-1"] * 2
    play.does(play.machine.restart, "a-1", "changed")
    play.up()
    play.ends(code=1)
    play.waits(1)
    assert play.runs == ["a-1"] * 4


def test_a_restart_is_for_one_end() -> None:
    """The next death is one."""
    play = Play(start())
    play.does(play.machine.restart, "a-1", "changed")
    play.ends()
    play.ends()
    assert play.runs == ["a-1"] * 2
    assert play.machine.finished


def test_a_second_stop_is_forced() -> None:
    """If it is not the first one's echo."""
    play = Play(start())
    assert play.does(play.machine.stop, "interrupted") == [Notify(ShuttingDown("interrupted")), StopAll()]
    assert play.does(play.machine.stop, "interrupted") == []
    play.waits(REPEATED_STOP_SEC)
    assert play.does(play.machine.stop, "interrupted") == [ForceStopAll()]
    assert not play.machine.finished
    play.ends(code=-9)
    assert play.machine.finished


def test_nothing_is_started_while_the_launch_ends() -> None:
    """Not what was to come, nor what handlers want; these may still speak."""
    play = Play(
        start("a", respawn=True),
        start("late", after_sec=1),
        whenever(ShuttingDown, LogText(text="bye"), start("b")),
        whenever(ProcessExited, start("c")),
    )
    play.does(play.machine.stop, "enough")
    play.ends("a-1")
    play.waits(10)
    assert play.said == ["INFO launch: bye"]
    assert play.runs == ["a-1"]
    assert play.machine.finished


@pytest.mark.parametrize("code", [0, 3])
def test_a_required_process_ends_the_launch(code: int) -> None:
    """Which has failed if the process has."""
    play = Play(start("a", required=True), start("b"))
    effects = play.ends("a-1", code)
    assert effects[-1] == StopAll()
    assert play.told(ShuttingDown) == [ShuttingDown("a-1 is required and has ended")]
    assert play.machine.failed is bool(code)
    play.ends("b-1", 1)
    assert play.machine.failed is bool(code)


@pytest.mark.parametrize(("code", "good"), [(0, True), (3, False), (-9, False), (-11, False)])
def test_the_last_run_of_each_process_counts(code: int, *, good: bool) -> None:
    """A launch fails with any process whose last run failed; earlier runs do not matter."""
    play = Play(start("a"), start("b", respawn=True, respawn_max_retries=1))
    play.ends("b-1", 3)
    play.waits(1)
    play.ends("a-1", code)
    play.ends("b-1", 0)
    assert play.machine.finished
    assert play.machine.succeeded is good


@pytest.mark.parametrize("code", [0, 1, -2, -9, -11])
def test_a_process_that_the_launch_stops_does_not_fail(code: int) -> None:
    """Whatever exit code it answers the signal with."""
    play = Play(start("a"), start("b"), End(reason="enough", after_sec=1))
    play.waits(1)
    play.ends("a-1")
    play.ends("b-1", code)
    assert play.machine.finished
    assert play.machine.succeeded


@pytest.mark.parametrize("code", [0, 1, -9])
def test_a_process_that_the_launch_restarts_does_not_fail(code: int) -> None:
    """The interrupted execution does not count; the one after it does when it ends by itself."""
    play = Play(start("a"))
    play.does(play.machine.restart, "a-1", "changed")
    play.ends(code=code)
    assert play.machine.succeeded
    play.ends(code=1)
    assert play.machine.finished
    assert not play.machine.succeeded


@pytest.mark.parametrize(("wait_sec", "succeeded"), [(0.0, False), (10.0, True)])
def test_the_last_run_of_a_process_that_died_counts(wait_sec: float, succeeded: bool) -> None:
    """A process that died has failed until it runs again; the launch's own signal ends that run well."""
    play = Play(start("a", respawn=True, respawn_delay_sec=1.0))
    play.ends(code=1)
    play.waits(wait_sec)
    play.does(play.machine.stop, "enough")
    if play.machine.state("a-1") is ProcessState.UP:
        play.ends(code=0)
    assert play.machine.finished
    assert play.machine.succeeded is succeeded


@pytest.mark.parametrize("code", [0, 3])
def test_a_required_process_that_died_may_be_mended(code: int) -> None:
    """Where processes can be started on demand; one that has done its work ends the launch there, too."""
    play = Play(start(required=True), keep=True)
    play.ends(code=code)
    assert play.machine.stopping is (code == 0)
    assert not play.machine.failed


def test_the_end_of_a_process_may_have_a_reason() -> None:
    """Of its own, which is what is reported."""
    play = Play(start("a", required=True, end_reason="over"))
    play.ends("a-1")
    assert play.told(ShuttingDown) == [ShuttingDown("a-1 has ended: over")]


def test_a_required_process_may_be_started_again_first() -> None:
    """Only its last end is the launch's."""
    play = Play(start(required=True, respawn=True, respawn_max_retries=1))
    play.ends(code=1)
    assert not play.machine.stopping
    play.waits(1)
    play.ends(code=1)
    assert play.machine.failed


def test_an_outcome_without_a_process_is_an_end() -> None:
    """A program that could not be started has no number."""
    play = Play(start())
    play.does(play.machine.ended, "a-1", Outcome(normal=False, reason="no"))
    assert play.told(ProcessExited)[0].pid is None
    assert play.machine.finished


@pytest.mark.parametrize(
    ("steps", "awaited"),
    [
        ([start(), LogText(text="x")], False),
        ([start(depends_on=(ADD,))], True),
        ([whenever(Appeared, LogText(text="x"), presence=ADD)], True),
        ([whenever(ProcessExited, LogText(text="x"))], False),
        ([whenever(ProcessExited, start(depends_on=(ADD,)))], True),
        ([Call(name="f()", steps=list)], True),
    ],
)
def test_the_graph_is_followed_if_something_may_ask(steps: Sequence[Step], *, awaited: bool) -> None:
    """What functions will give is not known before."""
    assert awaits_graph(steps) is awaited


def test_levels_are_words() -> None:
    """A warning of the plan is one for people."""
    assert Play(LogText(text="x", warning=True)).told(Message) == [Message(Level.WARN, "x")]
