"""Event handlers, and the queue in which their reactions are carried out one after the other.

A reaction is a generator, because a function of the description may run in a thread in the middle, and the
steps after that wait for it. One reaction runs at a time. If two ran at once, the order of what they
start and log would depend on how long their functions take.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from actors.launch.planning.events import Level, Message, ProcessIO
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Sequence

    from actors.launch.engine.effects import CallFunction
    from actors.launch.planning.events import Event
    from actors.launch.planning.steps import AddHandler, Step

MAX_HANDLERS: Final = 10_000
"""Only a launch whose functions add handlers in a loop reaches this."""
MAX_QUEUED_EVENTS: Final = 10_000
"""Events that may wait for their reactions while a function runs; further ones are only counted."""
MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
"""Bytes of output that the waiting events may hold together."""
LINE_BYTES: Final = 64
"""Memory of a line beside its text, roughly."""
ABANDONED: Final = "a function of the description has not returned; going on without it"


class FunctionResult(NamedTuple):
    """The result of a function of the description.

    Attributes:
        steps: The steps that it has returned.
        error: The error, if it failed; otherwise empty.
    """

    steps: Sequence[Step] = ()
    error: str = ""


def call_function(call: Callable[[], Sequence[Step]]) -> FunctionResult:
    """Call a function of a description, and return its steps or its error. This may block."""
    # Planning has turned every exception of the function into a LaunchError with its line. Others are bugs
    # here.
    try:
        return FunctionResult(call())
    except CallboardError as error:
        return FunctionResult(error=str(error))


Reaction: TypeAlias = "Generator[CallFunction, FunctionResult, None]"
"""Carries out steps; at each function of the description it yields, and is resumed with the result."""


class ReactionQueue:
    """Carries out reactions one after the other, in the order of the events that they react to.

    Args:
        emit: Called with each function that is to be called.
        notify: Called with warnings.
    """

    def __init__(self, emit: Callable[[CallFunction], None], notify: Callable[[Event], None]) -> None:
        self._emit = emit
        self._notify = notify
        self._reactions: deque[tuple[Reaction, int]] = deque()
        """Waiting reactions, with the bytes of output that each holds."""
        self._waiting_bytes = 0
        self._called: tuple[CallFunction, Reaction] | None = None
        self._abandoned = False
        self._unhandled = 0

    @property
    def waiting(self) -> bool:
        """Whether a function has been called and has not returned."""
        return self._called is not None

    def add(self, reaction: Reaction) -> None:
        """Carry out a reaction after all earlier ones: at once, unless a function is running."""
        self._add(reaction, 0)

    def add_for_event(self, reaction: Reaction, event: Event) -> None:
        """Carry out the reaction to an event; if too many are waiting, only count it."""
        size = sum(len(line) + LINE_BYTES for line in event.lines) if isinstance(event, ProcessIO) else 0
        if len(self._reactions) < MAX_QUEUED_EVENTS and self._waiting_bytes + size <= MAX_WAITING_BYTES:
            self._add(reaction, size)
        else:
            self._unhandled += 1

    def _add(self, reaction: Reaction, size: int) -> None:
        self._reactions.append((reaction, size))
        self._waiting_bytes += size
        if self._called is None:
            self._resume(None)

    def function_returned(self, call: CallFunction, result: FunctionResult) -> None:
        """Resume the reaction that waits for a function; ignore a result that is no longer awaited."""
        # An abandoned function may return later; by then another one may have been called.
        if self._called is not None and self._called[0] is call:
            self._resume(result)

    def abandon(self) -> None:
        """Stop waiting for the running function, and call no others: the launch ends."""
        self._abandoned = True
        if self._called is not None:
            self._notify(Message(Level.WARN, ABANDONED))
            self._resume(FunctionResult())

    def _resume(self, result: FunctionResult | None) -> None:
        """Resume the reaction that waits for a result, if there is one, and then run the queued ones."""
        reaction = None if self._called is None else self._called[1]
        self._called = None
        while reaction is not None or self._reactions:
            if reaction is None:
                reaction, size = self._reactions.popleft()
                self._waiting_bytes -= size
            try:
                call = next(reaction) if result is None else reaction.send(result)
            except StopIteration:
                reaction = result = None
                continue
            if not self._abandoned:
                self._called = call, reaction
                self._emit(call)
                return
            result = FunctionResult()  # the launch ends: as if the function had returned nothing
        # Reported once they are all done: a warning for each would make a flood of events worse.
        if self._unhandled:
            text = f"{self._unhandled} events were not handled: functions of the description are too slow"
            self._unhandled = 0
            self._notify(Message(Level.WARN, text))


class Handlers:
    """The registered event handlers."""

    def __init__(self) -> None:
        self._all: list[AddHandler] = []

    @property
    def full(self) -> bool:
        """Whether the limit is reached."""
        return len(self._all) >= MAX_HANDLERS

    def add(self, handler: AddHandler) -> None:
        """Register a handler."""
        self._all.append(handler)

    def matching(self, event: Event) -> Sequence[AddHandler]:
        """Return the handlers of an event, in the order of their registration."""
        # A list: the reactions of one handler may register others, which must not see this event.
        return [each for each in self._all if each.matches(event)]

    def remove(self, handler: AddHandler) -> None:
        """Unregister a handler."""
        # It may be gone: of two events in the queue, the first has removed a handler for one event.
        if handler in self._all:
            self._all.remove(handler)
