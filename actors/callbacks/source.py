"""Callback sources, whose callbacks a mailbox runs, and the share of a loop turn that a source gets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextvars import Context

    from actors.callbacks.callback_task import CallbackTask
    from actors.callbacks.timing import CallbackTiming


class CallbackSource(Protocol):
    """Something with callbacks to run."""

    posted: bool
    """Whether it is in the mailbox's queue; set by the mailbox."""
    timing: CallbackTiming
    """The durations of its callback; updated by the mailbox and by callback tasks."""
    calls: int
    """Number of calls of its callback so far."""

    @property
    def concurrent(self) -> bool:
        """Whether its callbacks run even while a coroutine callback holds the mailbox, and do not take it."""
        ...

    def dispatch(self, share: Share) -> CallbackTask | None:
        """Run queued callbacks until the share is used or one of them returns a coroutine.

        Args:
            share: Check `share.used` between two callbacks, and return when it is true.

        Returns:
            The coroutine as a callback task; None if there was none.
        """
        ...

    def has_work(self) -> bool:
        """Whether `dispatch` would run something now."""
        ...


class Share:
    """The time and the context that a source has in one dispatch.

    Attributes:
        clock: The budget's.
        until: The time on that clock after which the source must return.
        context: The context that the callbacks run in.
        original: The context of which `context` is a copy. After a callback that has changed `context`, the
            source must return.
    """

    __slots__ = ("clock", "context", "original", "until")

    def __init__(self, clock: Callable[[], float], original: Context) -> None:
        self.clock = clock
        self.until = 0.0
        self.original = original
        self.context = original.copy()

    @property
    def used(self) -> bool:
        """Whether the source must return."""
        return self.clock() >= self.until or changed(self.context, self.original)


def changed(context: Context, original: Context) -> bool:
    """Return whether a copy of a context has been changed.

    Cheap while it has not: both then share their contents. Values that cannot be compared count as changed.
    """
    try:
        # `!=` of two contexts compares their mappings. An unchanged copy shares its mapping with the
        # original, which makes the comparison one pointer test, where copying for each callback would make
        # objects.
        return context != original
    except Exception:  # noqa: BLE001 - the __eq__ of a user's value; arrays have no truth value, for example
        return True
