"""A launch in a task of its own, with its transcript, and waits that explain why they failed."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final, TypeVar

from actors.errors import WaitTimeout
from actors.launch.errors import LaunchError
from actors.testing.changes import ChangeSignal
from actors.testing.transcript import LAUNCH, ProcessState, Transcript
from actors.time.timeout import DefaultTimeout

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.launching import Launch
    from actors.launch.planning.events import Event
    from actors.time.timeout import Timeout

SHOWN_LINES: Final = 20
"""Lines of output that an error shows."""

T = TypeVar("T")


class LaunchWaitError(WaitTimeout, AssertionError):
    """The event that a test waited for did not happen in time, or cannot happen any more.

    The text names the event, the reason, the state of each process and the last lines of output.
    """


class LaunchRun:
    """Runs a launch in a task, from construction until `stop` or its end.

    Args:
        launch: The launch, prepared.
        timeout_sec: Deadline in seconds of waits that set none.
    """

    def __init__(self, launch: Launch, *, timeout_sec: float) -> None:
        self.transcript = Transcript()
        self.launch = launch
        launch.listen(self._on_event)
        self._timeout_sec = timeout_sec
        self._changes = ChangeSignal()
        self.task = asyncio.create_task(self.launch.run(), name="launch")
        self.task.add_done_callback(lambda _: self._changes.notify())

    def _on_event(self, event: Event) -> None:
        self.transcript.on_event(event)
        self._changes.notify()

    async def wait_for(
        self,
        failure: str,
        check: Callable[[], T | None],
        timeout_sec: Timeout,
        *,
        process: str | None = None,
    ) -> T:
        """Return the first result of `check` that is not None.

        Args:
            failure: Start of the error's text, such as "No line with 'ready'".
            check: Called at once and after each event.
            timeout_sec: Seconds to wait at most; `DEFAULT_TIMEOUT` is the launch's, None is no limit.
            process: The process that the result depends on; None: any.

        Raises:
            LaunchWaitError: The deadline passed, or the process or the launch has ended.
        """

        def check_or_raise() -> T | None:
            if (result := check()) is None:
                self._raise_if_over(failure, process)
            return result

        limit_sec = self._timeout_sec if isinstance(timeout_sec, DefaultTimeout) else timeout_sec
        limit = asyncio.timeout(limit_sec)
        try:
            async with limit:
                return await self._changes.wait_for(check_or_raise)
        except TimeoutError:
            if not limit.expired():  # raised by `check`
                raise
            hint = self._unknown_name_hint(process)
            raise LaunchWaitError(self._report(f"{failure} in {limit_sec:g} s{hint}", process)) from None

    def _raise_if_over(self, failure: str, process: str | None) -> None:
        if self.task.done():
            error = self.error()
            reason = "the launch has ended" if error is None else f"the launch has failed: {error}"
            reason += self._unknown_name_hint(process)
            raise LaunchWaitError(self._report(f"{failure}: {reason}", process)) from error
        known = [] if process is None else self.transcript.called(process)
        if known and all(each.state is ProcessState.ENDED for each in known):
            raise LaunchWaitError(self._report(f"{failure}: it has ended", process))

    def _unknown_name_hint(self, process: str | None) -> str:
        if process is None or process == LAUNCH or self.transcript.called(process):
            return ""
        return f"; no {self.unknown_name(process)}"

    def unknown_name(self, name: str) -> str:
        """Return an error text that lists the names of the processes that exist."""
        known = ", ".join(each.label for each in self.transcript.processes)
        return f"process is called '{name}'; there is: {known or 'none'}"

    def _report(self, failure: str, process: str | None) -> str:
        lines = list(self.transcript.lines(process)) or list(self.transcript.lines())
        return "\n".join(
            [
                failure,
                "Processes:",
                *(f"  {each}" for each in self.transcript.processes),
                f"Output, the last {SHOWN_LINES} lines:" if len(lines) > SHOWN_LINES else "Output:",
                *(f"  {line}" for line in lines[-SHOWN_LINES:]),
            ]
        )

    async def stop(self) -> None:
        """Stop the launch, as Ctrl-C does, and wait for its end; being cancelled here kills it."""
        cancelled: asyncio.CancelledError | None = None
        self.task.cancel()
        while not self.task.done():
            try:
                await asyncio.wait({self.task})
            except asyncio.CancelledError as error:
                cancelled = error
                self.task.cancel()
        if cancelled is not None:
            raise cancelled

    def error(self) -> BaseException | None:
        """Return the error of the launch itself, or None."""
        if self.task.done() and not self.task.cancelled() and (error := self.task.exception()) is not None:
            return error
        return LaunchError(self.launch.error) if self.launch.error else None

    def check(self) -> None:
        """Raise the error of the launch itself, if there is one."""
        if (error := self.error()) is not None:
            raise error

    def add_note_to(self, error: BaseException) -> None:
        """Add the launch's own error, if there is one, to the test's error as a note."""
        if (own := self.error()) is not None and own is not error.__cause__:
            error.add_note(f"The launch has failed: {own}")
