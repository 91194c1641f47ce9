"""Random histories of a launch: whatever happens in whatever order, what the machine wants makes sense."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Final

import pytest

from actors.launch.engine.effects import CallFunction, ForceStopAll, Notify, Run, Stop, StopAll
from actors.launch.engine.handlers import ABANDONED, call_function
from actors.launch.engine.machine import Machine
from actors.launch.engine.process_table import ProcessState
from actors.launch.planning.events import (
    Appeared,
    Event,
    Level,
    Message,
    ProcessExited,
    ProcessStarted,
    ShuttingDown,
)
from actors.launch.planning.presence import Presence, PresenceKind
from actors.launch.planning.process_spec import ProcessSpec
from actors.launch.planning.steps import AddHandler, End, LogText, Start
from actors.processes.outcome import outcome_of_exit

if TYPE_CHECKING:
    from actors.launch.engine.effects import Effect
    from actors.launch.planning.steps import Step

SEEDS: Final = 300
MOMENTS: Final = 150
THINGS: Final = [Presence(PresenceKind.NODE, f"/n{number}") for number in range(3)]


class History:
    """A launch with a random description, in a world that does random things.

    Attributes:
        machine: The machine.
        executions: The processes that run, by label, and whether they have said so.
    """

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._names = 0
        steps = [self._start(), *self._steps(0)]
        self.machine = Machine(keep=self._maybe(0.3))
        self.now = 0.0
        self.executions: dict[str, bool] = {}
        self.asked: list[CallFunction] = []
        self._does(self.machine.begin(steps, self.now))

    def _maybe(self, chance: float) -> bool:
        return self._random.random() < chance

    def _spec(self, depth: int) -> ProcessSpec:
        self._names += 1
        choice = self._random.choice
        return ProcessSpec(
            label=f"p-{self._names}",
            name="p",
            command=("p",),
            shown="p",
            depends_on=tuple(self._random.sample(THINGS, choice([0, 0, 1, 2]))),
            depends_timeout_sec=choice([1.0, 5.0, float("inf")]),
            respawn=self._maybe(0.5),
            respawn_delay_sec=choice([0.1, 1.0]),
            respawn_backoff=choice([1.0, 2.0]),
            respawn_max_delay_sec=4.0,
            respawn_max_retries=choice([-1, 0, 2]),
            required=self._maybe(0.1),
            made_later=depth > 0 and self._maybe(0.5),
        )

    def _start(self, depth: int = 0) -> Start:
        on_exit = self._react(depth + 1, Event) if self._maybe(0.2) and depth < 2 else None
        after_sec = self._random.choice([0.0, 0.0, 0.5, 2.0])
        return Start(process=self._spec(depth), on_exit=on_exit, after_sec=after_sec)

    def _react(self, depth: int, kind: type[Event]) -> AddHandler:
        awaited = self._random.choice(THINGS) if kind is Appeared else None
        steps = self._steps(depth)

        def matches(event: Event) -> bool:
            return isinstance(event, kind) and (awaited is None or event == Appeared(awaited))

        return AddHandler(
            what="x",
            matches=matches,
            steps=lambda _event: steps,  # the same ones each time: what runs still is not started twice
            preview=tuple(steps),
            once=self._maybe(0.5),
            calls=self._maybe(0.3),
            presence=awaited,
        )

    def _steps(self, depth: int) -> list[Step]:
        steps: list[Step] = []
        for _ in range(self._random.randrange(4)):
            chance = self._random.random()
            if chance < 0.5:
                steps.append(self._start(depth))
            elif chance < 0.6:
                steps.append(LogText(text="x"))
            elif chance < 0.62:
                steps.append(End(reason="x", after_sec=2.0))
            elif depth < 2:
                kinds = [ProcessStarted, ProcessExited, Appeared, ShuttingDown]
                steps.append(self._react(depth + 1, self._random.choice(kinds)))
        return steps

    def _does(self, effects: list[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, Run):
                assert effect.process.label not in self.executions, "started though it runs"
                assert not self.machine.stopping or StopAll() in effects, "started while the launch ends"
                self.executions[effect.process.label] = False
            elif isinstance(effect, Stop):
                assert effect.label in self.executions, "stopped though it does not run"
            elif isinstance(effect, ForceStopAll):
                assert self.machine.stopping
            elif isinstance(effect, Notify) and effect.event == Message(Level.WARN, ABANDONED):
                self.asked.clear()
            elif isinstance(effect, CallFunction):
                assert not self.asked, "asked though a function runs"
                self.asked.append(effect)

    def goes_on(self) -> None:
        """Let something happen."""
        chance, machine = self._random.random(), self.machine
        if machine.wake_at is not None and chance < 0.4:
            self.now = max(self.now, machine.wake_at)
            self._does(machine.tick(self.now))
        elif self.asked and chance < 0.6:
            self._connects()
        elif self.executions and chance < 0.8:
            self._happens_to(self._random.choice(sorted(self.executions)))
        elif chance < 0.9:
            there = frozenset(self._random.sample(THINGS, self._random.randrange(4)))
            self._does(machine.graph(there, self.now))
        elif chance < 0.97:
            label = f"p-{self._random.randint(1, self._names)}"
            self._does(machine.restart(label, "changed", self.now))
        elif chance > 0.985:
            self._does(machine.stop("enough", self.now, escalate=self._maybe(0.5)))
        self.now += self._random.choice([0.0, 0.0, 0.01, 0.3])

    def _connects(self) -> None:
        asked = self.asked.pop()
        self._does(self.machine.function_returned(asked, call_function(asked.call), self.now))

    def _happens_to(self, label: str) -> None:
        if not self.executions[label] and self._maybe(0.8):
            self.executions[label] = True
            self._does(self.machine.started(label, 7, self.now))
        else:
            del self.executions[label]
            outcome = outcome_of_exit(self._random.choice([0, 1, -2]))
            self._does(self.machine.ended(label, outcome, self.now))

    def check(self) -> None:
        """What the machine believes is so."""
        machine = self.machine
        labels = [f"p-{number}" for number in range(1, self._names + 1)]
        up = {label for label in labels if machine.state(label) is ProcessState.UP}
        assert up == self.executions.keys()
        restarting = any(machine.state(label) is ProcessState.RESTARTING for label in labels)
        assert machine.wake_at is not None or not restarting
        assert machine.finished is (machine.stopping and not self.executions and not self.asked)

    def ends(self) -> None:
        """Stop it; it is over when all that ran has ended."""
        self._does(self.machine.stop("enough", self.now))
        for label in tuple(self.executions):
            del self.executions[label]
            self._does(self.machine.ended(label, outcome_of_exit(0), self.now))
        while self.asked:
            self._connects()
        assert not self.executions
        assert self.machine.finished


@pytest.mark.parametrize("first", range(0, SEEDS, 50))
def test_the_machine_knows_what_runs(first: int) -> None:
    """It starts nothing twice and nothing while the launch ends, and comes to an end when it is told to."""
    for seed in range(first, first + 50):
        history = History(seed)
        try:
            for _ in range(MOMENTS):
                history.check()
                if history.machine.finished:
                    break
                history.goes_on()
            history.ends()
        except Exception as error:
            raise AssertionError(f"seed {seed}: {error!r}") from error
