"""The callback budget: how long callbacks may run in one iteration of an event loop.

All nodes of a loop share one budget. While it lasts, callbacks run where their message arrives. When it is
exhausted, what is left queues here and continues in later loop turns, first come, first served.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import TYPE_CHECKING, Final
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from collections.abc import Callable

BUDGET_SEC: Final = 0.004
"""Seconds of callbacks between two loop turns: much less than keepalive, much more than a loop's overhead."""

SHARE_SEC: Final = 0.001
"""Seconds of callbacks of one source (subscription, service, timer) in a row, while other sources wait."""


class CallbackBudget:
    """The callback budget of one event loop.

    Args:
        clock: Steady seconds, read before and after callbacks.

    Attributes:
        clock: The clock, for callers that measure by it.
        exhausted: Whether callbacks must wait for the next loop turn.
        step_sec: An estimate of what a step of a coroutine callback takes: the longest of the last few.
    """

    __slots__ = ("__weakref__", "_renewal_due", "_spent_sec", "_waiting", "clock", "exhausted", "step_sec")

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self.clock = clock
        self.exhausted = False
        self._spent_sec = 0.0
        self.step_sec = 0.0
        self._renewal_due = False
        # One queue for both, so that they continue in the order in which they ran out of budget, whichever
        # node they belong to. With a queue for each, a node with many plain callbacks could overtake
        # another's coroutines.
        self._waiting: deque[Callable[[], None] | asyncio.Future[None]] = deque()
        """Mailboxes with work left, and coroutine callbacks about to take a step."""

    @staticmethod
    def of(loop: asyncio.AbstractEventLoop) -> CallbackBudget:
        """Return the budget that all nodes of a loop share."""
        # Per loop, not per node: the promise is that the loop gets its turn in time, and a hundred nodes
        # with a budget each would break it as one node without any.
        budget = _budgets.get(loop)
        if budget is None:
            budget = _budgets[loop] = CallbackBudget()
        return budget

    def spend(self, seconds: float) -> None:
        """Count seconds for which callbacks have run."""
        self._spent_sec = spent = self._spent_sec + seconds
        # Below a share no renewal is scheduled, so a loop with little to do pays nothing for its budget.
        if spent >= SHARE_SEC:
            self.exhausted = spent >= BUDGET_SEC
            self._renew_later()

    def spend_step(self, seconds: float) -> None:
        """Count seconds for which a step of a coroutine callback has run."""
        # A rise counts at once, a fall slowly: an estimate that is too low wakes steps that together hold
        # the loop for too long, one that is too high costs another loop turn only.
        self.step_sec = seconds if seconds > self.step_sec else 0.9 * self.step_sec
        self._spent_sec = spent = self._spent_sec + seconds
        if spent >= SHARE_SEC:
            self.exhausted = spent >= BUDGET_SEC
            self._renew_later()

    def continue_later(self, run: Callable[[], None]) -> None:
        """Call `run` in a later loop turn, after what waits already. Needs an exhausted budget."""
        self._waiting.append(run)

    async def wait(self) -> None:
        """Wait for a later loop turn, after what waits already. Needs an exhausted budget.

        Several waiters may be woken together, so that the caller must check the budget again.
        """
        waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.append(waiter)
        await waiter

    def _renew_later(self) -> None:
        if not self._renewal_due:
            self._renewal_due = True
            # `call_soon` from within a loop turn runs in the next one, after the loop has polled its
            # sockets and timers. That poll is what the budget is for.
            asyncio.get_running_loop().call_soon(self._renew)

    def _renew(self) -> None:
        """Begin a loop turn with a full budget."""
        self._renewal_due = self.exhausted = False
        self._spent_sec = 0.0
        waiting = self._waiting
        try:
            while waiting and not self.exhausted:
                if isinstance(waiting[0], asyncio.Future):
                    self._wake_steps()
                    return  # woken steps run in the next loop turn and need what is left
                # A mailbox that runs out of budget again appends itself, behind those that have not had a
                # turn yet.
                run = waiting.popleft()
                assert not isinstance(run, asyncio.Future)
                run()
        finally:
            # Also if `run` has raised: the others in the queue have nobody else to continue them.
            if waiting:
                self._renew_later()

    def _wake_steps(self) -> None:
        """Wake the first steps in the queue: as many as fit the budget if they take as long as the last."""
        waiting, estimate = self._waiting, 0.0
        while waiting and isinstance(waiter := waiting[0], asyncio.Future) and estimate < BUDGET_SEC:
            waiting.popleft()
            # A cancelled waiter takes no step, and so needs nothing of the budget.
            if not waiter.done():
                waiter.set_result(None)  # pyright: ignore[reportUnknownMemberType]
                estimate += self.step_sec


# Weak keys: a budget ends with its loop, and a program may make many loops (tests do).
_budgets: Final[WeakKeyDictionary[asyncio.AbstractEventLoop, CallbackBudget]] = WeakKeyDictionary()
