"""Launches in tests: what a description says, started, watched and stopped again.

    async with launch("robot.launch.py") as running:
        await running.wait_for_service("/ns1/add_two_ints")
        line = await running.wait_for_output("Result", process="my_client")
        assert await running.wait_for_exit("my_client") == 0

Every wait ends: with what was waited for, at its limit, or as soon as it is clear that it never comes. Its
error says then what the processes do and have written.
"""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager, contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from actors.config.environment import foreign_variables
from actors.launch.description.description import LaunchDescription
from actors.launch.engine.captured_logs import captured_logs
from actors.launch.engine.captured_streams import captured_streams
from actors.launch.errors import LaunchError
from actors.launch.launching import Launch
from actors.launch.planning.presence import Presence, PresenceKind
from actors.testing.transcript import LAUNCH, ProcessState, Search, Transcript
from broker import Broker, BrokerOptions
from proto.errors import CallboardError

if TYPE_CHECKING:
    import re
    from collections.abc import AsyncGenerator, Callable, Generator, Iterable, Mapping

    from actors.launch.description.actions import Action
    from actors.launch.planning.events import Event
    from actors.testing.transcript import OutputLine, ProcessStatus

WAIT_TIMEOUT_SEC: Final = 10.0
STOP_TIMEOUT_SEC: Final = 2.0
"""Shorter than a launch's own: nobody likes tests that wait."""
SHOWN_LINES: Final = 20
"""How many an error shows."""

T = TypeVar("T")


class LaunchWaitError(CallboardError, AssertionError):
    """What was waited for did not come, in time or ever.

    The text says what that was, why it does not come, what each process does and what was written last.
    """


class RunningLaunch:
    """A launch that runs; `launch` makes it.

    A process is called by its label ("talker-1"), by that without the number ("talker"), or by the full name
    of its node, if the description says it. "launch" is the launch itself, with what `LogInfo` says.

    Each `wait_for` raises LaunchWaitError when what it waits for does not come within `timeout_sec` (None: as
    `launch` was told), and at once when it cannot come any more.

    Attributes:
        url: Where the broker is, for nodes of the test itself.
        domain: Which of its graphs.
    """

    def __init__(self, launch: Launch, *, timeout_sec: float) -> None:
        self._timeout_sec = timeout_sec
        self._transcript = Transcript()
        self._waiting: dict[asyncio.Event, None] = {}
        self._launch = launch
        launch.listen(self._hear)
        self.url = self._launch.place.url
        self.domain = self._launch.place.domain
        self._run = asyncio.create_task(self._launch.run(), name="launch")
        self._run.add_done_callback(lambda _: self._wake())

    # What is to be known

    @property
    def dropped_lines(self) -> int:
        """Lines that are not kept any more: the last 10,000 are, as far as they fit into 4 MiB."""
        return self._transcript.dropped_lines

    def output(self, process: str | None = None) -> str:
        """Return what has been written so far, as far as it is kept: by one process, or in all."""
        return "".join(f"{line.text}\n" for line in self._transcript.lines(process))

    def processes(self) -> tuple[ProcessStatus, ...]:
        """Return all processes that there have been, in the order in which they came."""
        return self._transcript.processes

    def process(self, name: str) -> ProcessStatus:
        """Return one of them.

        Raises:
            LookupError: There is none of this name (yet), or more than one.
        """
        found = self._transcript.called(name)
        if len(found) == 1:
            return found[0]
        if not found:
            raise LookupError(f"No {self._unknown(name)}")
        labels = ", ".join(each.label for each in found)
        raise LookupError(f"More than one process is called '{name}': {labels}")

    # Waiting

    async def wait_for_output(
        self,
        text: str | re.Pattern[str],
        *,
        process: str | None = None,
        after: OutputLine | None = None,
        timeout_sec: float | None = None,
    ) -> OutputLine:
        """Wait for a line; return the first one, also if it came before.

        Args:
            text: What is in it; or a pattern that is.
            process: Whose line; None: anybody's, the launch's too.
            after: Only lines behind this one, which an earlier wait has returned.
            timeout_sec: How long.
        """
        search = Search(text, process)
        what = f"No line with {text!r}" if isinstance(text, str) else f"No line with {text.pattern!r}"
        self._transcript.begin(search, after=after)
        try:
            return await self._wait(
                what if process is None else f"{what} from {process}",
                lambda: search.found,
                timeout_sec,
                process=process,
            )
        finally:
            self._transcript.end(search)

    async def wait_for_exit(self, process: str, *, timeout_sec: float | None = None) -> int:
        """Wait until a process has ended, and is not started again; return its exit code.

        That is negative for a signal: -2 for SIGINT. A node in the launch's own process has 0 if it ended
        well, else 1.
        """

        def ended() -> int | None:
            found = self._transcript.called(process)
            if len(found) > 1:
                names = ", ".join(each.label for each in found)
                raise LaunchWaitError(f"No end of {process}: there are more of that name: {names}")
            return found[0].exit_code if found and found[0].state is ProcessState.ENDED else None

        return await self._wait(f"No end of {process}", ended, timeout_sec, process=process)

    async def wait_for_node(self, name: str, *, timeout_sec: float | None = None) -> None:
        """Wait until a node is in the graph; `name` is its full name."""
        await self._wait_for(PresenceKind.NODE, name, timeout_sec)

    async def wait_for_topic(self, name: str, *, timeout_sec: float | None = None) -> None:
        """Wait until a topic has a publisher; `name` is its full name."""
        await self._wait_for(PresenceKind.TOPIC, name, timeout_sec)

    async def wait_for_service(self, name: str, *, timeout_sec: float | None = None) -> None:
        """Wait until a service has a server; `name` is its full name."""
        await self._wait_for(PresenceKind.SERVICE, name, timeout_sec)

    async def wait_for_end(self, *, timeout_sec: float | None = None) -> bool:
        """Wait until the launch has ended; return False if a process failed by itself.

        Raises:
            LaunchWaitError: It goes on.
            LaunchError: The description has turned out to be wrong.
        """
        await self._wait("No end of the launch", lambda: self._run.done() or None, timeout_sec)
        self.check()
        return self._run.cancelled() or self._run.result()

    async def wait_until(self, condition: Callable[[], object], *, timeout_sec: float | None = None) -> None:
        """Wait until the condition holds; it is looked at whenever something has happened in the launch."""
        what = "What was waited for did not come true"
        await self._wait(what, lambda: True if condition() else None, timeout_sec)

    async def _wait_for(self, kind: PresenceKind, name: str, timeout_sec: float | None) -> None:
        wanted = Presence(kind, name if name.startswith("/") else f"/{name}")
        await self._wait(f"No {wanted}", lambda: wanted in self._launch.presences or None, timeout_sec)

    async def _wait(
        self,
        what: str,
        look: Callable[[], T | None],
        timeout_sec: float | None,
        *,
        process: str | None = None,
    ) -> T:
        """Wait until a look gives something."""
        limit_sec = self._timeout_sec if timeout_sec is None else timeout_sec
        limit = asyncio.timeout(limit_sec)
        happened = asyncio.Event()
        self._waiting[happened] = None
        try:
            async with limit:
                while (found := look()) is None:
                    self._give_up(what, process)
                    happened.clear()
                    await happened.wait()
                return found
        except TimeoutError:
            if not limit.expired():  # it is the look's own
                raise
            stranger = self._stranger(process)
            raise LaunchWaitError(self._report(f"{what} in {limit_sec:g} s{stranger}", process)) from None
        finally:
            del self._waiting[happened]

    def _give_up(self, what: str, process: str | None) -> None:
        """Raise if nothing more comes: of this process, or of all."""
        if self._run.done():
            error = self._error()
            why = "the launch has ended" if error is None else f"the launch has failed: {error}"
            why += self._stranger(process)
            raise LaunchWaitError(self._report(f"{what}: {why}", process)) from error
        known = [] if process is None else self._transcript.called(process)
        if known and all(each.state is ProcessState.ENDED for each in known):
            raise LaunchWaitError(self._report(f"{what}: it has ended", process))

    def _stranger(self, process: str | None) -> str:
        """Say that nobody has the name of the process that is waited for, if that is so."""
        if process is None or process == LAUNCH or self._transcript.called(process):
            return ""
        return f"; no {self._unknown(process)}"

    def _unknown(self, name: str) -> str:
        known = ", ".join(each.label for each in self.processes())
        return f"process is called '{name}'; there is: {known or 'none'}"

    def _report(self, what: str, process: str | None) -> str:
        """Return what people need to see why a wait has failed."""
        written = list(self._transcript.lines(process)) or list(self._transcript.lines())
        return "\n".join(
            [
                what,
                "Processes:",
                *(f"  {each}" for each in self.processes()),
                f"Output, the last {SHOWN_LINES} lines:" if len(written) > SHOWN_LINES else "Output:",
                *(f"  {line}" for line in written[-SHOWN_LINES:]),
            ]
        )

    # Its end

    async def stop(self) -> None:
        """Stop everything, as Ctrl-C does, and wait until it has ended. A cancellation meanwhile kills it."""
        cancelled: asyncio.CancelledError | None = None
        self._run.cancel()
        while not self._run.done():
            try:
                await asyncio.wait({self._run})
            except asyncio.CancelledError as error:
                cancelled = error
                self._run.cancel()
        if cancelled is not None:
            raise cancelled

    def check(self) -> None:
        """Raise what has gone wrong in the launch itself, if anything has.

        Raises:
            LaunchError: The description has turned out to be wrong.
            BrokerUnreachable: There is no broker where the test says.
        """
        if (error := self._error()) is not None:
            raise error

    def add_to(self, error: BaseException) -> None:
        """Add to the test's own error what has gone wrong in the launch, if anything has."""
        if (own := self._error()) is not None and own is not error.__cause__:
            error.add_note(f"The launch has failed: {own}")

    def _error(self) -> BaseException | None:
        if self._run.done() and not self._run.cancelled() and (error := self._run.exception()) is not None:
            return error
        return LaunchError(self._launch.mistake) if self._launch.mistake else None

    # What happens

    def _hear(self, event: Event) -> None:
        self._transcript.hear(event)
        self._wake()

    def _wake(self) -> None:
        for happened in self._waiting:
            happened.set()


@asynccontextmanager
async def launch(
    description: LaunchDescription | str | PathLike[str] | Iterable[Action],
    *,
    arguments: Mapping[str, str] | None = None,
    url: str | None = None,
    domain: int = 0,
    environment: Mapping[str, str] | None = None,
    folder: str | PathLike[str] | None = None,
    stop_timeout_sec: float = STOP_TIMEOUT_SEC,
    timeout_sec: float = WAIT_TIMEOUT_SEC,
) -> AsyncGenerator[RunningLaunch]:
    """Run a launch while the context is entered. When it is left nothing of the launch is left.

    Args:
        description: A description, the path of a launch file, or actions.
        arguments: Launch arguments.
        url: The broker; None: one of the launch's own, on a free port, so that tests can run side by side.
        domain: Which of the broker's graphs.
        environment: Variables for its programs, beside those of this process that are not callboard's.
        folder: Where relative paths in the description are seen from, say `Path(__file__).parent`; None: a
            launch file's own folder, or this process's, wherever the tests have been started.
        stop_timeout_sec: What each step of stopping a process may take: SIGINT, SIGTERM, SIGKILL.
        timeout_sec: What waits get that say nothing else.

    Raises:
        LaunchError: The description cannot be carried out: on entry; what turns out later, on leaving.
        UnknownArgumentError: Nobody knows an argument that was given.
        BrokerUnreachable: On leaving: no broker answers at `url`.
    """
    async with AsyncExitStack() as stack:
        stack.enter_context(_ears.open())
        if url is None:
            url = (await stack.enter_async_context(Broker(BrokerOptions(port=0)))).url

        made = Launch(
            _described(description),
            arguments=arguments,
            url=url,
            domain=domain,
            environment={**foreign_variables(), **(environment or {})},
            folder=None if folder is None else Path(folder),
            stop_timeout_sec=stop_timeout_sec,
            watch_graph=True,
        )
        await made.prepare()
        running = RunningLaunch(made, timeout_sec=timeout_sec)
        try:
            yield running
        except BaseException as error:
            await running.stop()
            running.add_to(error)
            raise
        await running.stop()
        running.check()


class _Ears:
    """Hear what nodes in this process log and print, as their output, while there is a launch, or more."""

    def __init__(self) -> None:
        self._users = 0
        self._installed = ExitStack()

    @contextmanager
    def open(self) -> Generator[None]:
        """Hear meanwhile. The logging and the streams are the whole process's: one pair of ears is enough."""
        if not self._users:
            self._installed.enter_context(captured_logs())
            self._installed.enter_context(captured_streams())
        self._users += 1
        try:
            yield
        finally:
            self._users -= 1
            if not self._users:
                self._installed.close()


_ears: Final = _Ears()


def _described(given: LaunchDescription | str | PathLike[str] | Iterable[Action]) -> LaunchDescription | Path:
    if isinstance(given, LaunchDescription):
        return given
    return Path(given) if isinstance(given, str | PathLike) else LaunchDescription(given)
