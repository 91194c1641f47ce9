"""Launches in tests: start a description, watch it and stop it.

    async with launch("robot.launch.py") as running:
        await running.wait_for_service("/ns1/add_two_ints")
        line = await running.wait_for_output("Result", process="my_client")
        assert await running.wait_for_exit("my_client") == 0

Each wait ends at the event, at its deadline, or as soon as the event cannot happen any more. Its error then
shows the state and the output of the processes.
"""

from __future__ import annotations

from contextlib import AsyncExitStack, asynccontextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.config.environment import variables_for_tests
from actors.launch.description.description import LaunchDescription
from actors.launch.engine.captured_output import captured_nodes
from actors.launch.launching import Launch
from actors.launch.planning.presence import Presence, PresenceKind
from actors.testing.launch_run import LaunchRun, LaunchWaitError
from actors.testing.transcript import ProcessState, Search
from actors.time.timeout import DEFAULT_TIMEOUT
from broker import Broker, BrokerOptions

if TYPE_CHECKING:
    import re
    from collections.abc import AsyncGenerator, Callable, Iterable, Mapping

    from actors.launch.description.action import Action
    from actors.testing.transcript import OutputLine, ProcessStatus
    from actors.time.timeout import Timeout

WAIT_TIMEOUT_SEC: Final = 10.0
STOP_TIMEOUT_SEC: Final = 2.0
"""Shorter than a launch's default, to keep tests short."""


class RunningLaunch:
    """A running launch; `launch` makes it.

    A process is identified by its label ("talker-1"), by the label without the number ("talker"), or by the
    full name of its node, if the description contains it. "launch" means the launch itself, with the output
    of `LogInfo`.

    Each `wait_for` method raises LaunchWaitError if its event does not happen within `timeout_sec` (None: the
    `timeout_sec` of `launch`), and immediately when it cannot happen any more.

    Attributes:
        url: The broker's URL, for nodes of the test itself.
        domain: The graph on that broker, 0 to 232.
    """

    def __init__(self, _run: LaunchRun) -> None:
        self._run = _run
        self._transcript = _run.transcript
        self.url = _run.launch.target.url
        self.domain = _run.launch.target.domain

    @property
    def dropped_lines(self) -> int:
        """Lines dropped so far: only the last 10,000 are kept, and at most 4 MiB of them."""
        return self._transcript.dropped_lines

    def output(self, process: str | None = None) -> str:
        """Return the kept output so far.

        Args:
            process: Whose output; None: that of all processes and of the launch.
        """
        return "".join(f"{line.text}\n" for line in self._transcript.lines(process))

    def processes(self) -> tuple[ProcessStatus, ...]:
        """Return all processes, ended ones included, in the order in which they appeared."""
        return self._transcript.processes

    def process(self, name: str) -> ProcessStatus:
        """Return one process.

        Args:
            name: Its label, the label without the number, or its node's full name.

        Raises:
            LookupError: No process has this name (yet), or more than one has.
        """
        found = self._transcript.called(name)
        if len(found) == 1:
            return found[0]
        if not found:
            raise LookupError(f"No {self._run.unknown_name(name)}")
        labels = ", ".join(each.label for each in found)
        raise LookupError(f"More than one process is called '{name}': {labels}")

    async def wait_for_output(
        self,
        text: str | re.Pattern[str],
        *,
        process: str | None = None,
        after: OutputLine | None = None,
        timeout_sec: Timeout = DEFAULT_TIMEOUT,
    ) -> OutputLine:
        """Wait for a line of output; lines from before the call count too.

        Args:
            text: A part of the line, or a pattern that is searched in it.
            process: Whose line; None: any process's, or the launch's.
            after: Only lines after this one, the result of an earlier wait.
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            The first such line.

        Raises:
            LaunchWaitError: There is no such line in time.
        """
        search = Search(text, process)
        failure = f"No line with {text!r}" if isinstance(text, str) else f"No line with {text.pattern!r}"
        if process is not None:
            failure += f" from {process}"
        self._transcript.begin(search, after=after)
        try:
            return await self._run.wait_for(failure, lambda: search.found, timeout_sec, process=process)
        finally:
            self._transcript.end(search)

    async def wait_for_exit(self, process: str, *, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> int:
        """Wait until a process has ended and is not started again.

        Args:
            process: Its name.
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            Its exit code; negative for a signal: -2 for SIGINT. A node in the launch's own process has 0 if
            it ended well, else 1.

        Raises:
            LaunchWaitError: It did not end in time, or several processes have this name.
        """

        def exit_code() -> int | None:
            found = self._transcript.called(process)
            if len(found) > 1:
                names = ", ".join(each.label for each in found)
                raise LaunchWaitError(f"No end of {process}: more than one process has that name: {names}")
            return found[0].exit_code if found and found[0].state is ProcessState.ENDED else None

        return await self._run.wait_for(f"No end of {process}", exit_code, timeout_sec, process=process)

    async def wait_for_node(self, name: str, *, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until a node is in the graph.

        Args:
            name: Its full name.
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            LaunchWaitError: It did not appear in time.
        """
        await self._wait_for(PresenceKind.NODE, name, timeout_sec)

    async def wait_for_topic(self, name: str, *, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until a topic has a publisher.

        Args:
            name: Its full name.
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            LaunchWaitError: None appeared in time.
        """
        await self._wait_for(PresenceKind.TOPIC, name, timeout_sec)

    async def wait_for_service(self, name: str, *, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Wait until a service has a server.

        Args:
            name: Its full name.
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            LaunchWaitError: None appeared in time.
        """
        await self._wait_for(PresenceKind.SERVICE, name, timeout_sec)

    async def wait_for_end(self, *, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> bool:
        """Wait until the launch has ended.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            False if it ended because a required process died.

        Raises:
            LaunchWaitError: It did not end in time.
            LaunchError: The description is wrong.
            BrokerUnreachable: There is no broker at the test's URL.
        """
        task = self._run.task
        await self._run.wait_for("No end of the launch", lambda: task.done() or None, timeout_sec)
        self._run.check()
        return task.cancelled() or task.result()

    async def wait_until(
        self, condition: Callable[[], object], *, timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> None:
        """Wait until a condition holds.

        Args:
            condition: Called at once and after each event of the launch, until its result is true.
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            LaunchWaitError: It did not hold in time.
        """
        failure = "The condition did not become true"
        await self._run.wait_for(failure, lambda: True if condition() else None, timeout_sec)

    async def _wait_for(self, kind: PresenceKind, name: str, timeout_sec: Timeout) -> None:
        wanted = Presence(kind, name if name.startswith("/") else f"/{name}")
        launch = self._run.launch
        await self._run.wait_for(f"No {wanted}", lambda: wanted in launch.presences or None, timeout_sec)

    async def stop(self) -> None:
        """Stop everything, as Ctrl-C does, and wait until it has ended; being cancelled here kills it."""
        await self._run.stop()


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
    """Run a launch while the context is entered; leaving it stops all of its processes.

    Args:
        description: A description, the path of a launch file, or actions.
        arguments: Launch arguments.
        url: The broker's URL; None: start one on a free port, so that tests can run in parallel.
        domain: The graph on that broker, 0 to 232.
        environment: Variables for its programs, added to those of this process that are not callboard's.
        folder: Base of relative paths in the description, such as `Path(__file__).parent`; None: the folder
            of the launch file, or the current one.
        stop_timeout_sec: Seconds for each step of stopping a process: SIGINT, SIGTERM, SIGKILL.
        timeout_sec: Deadline in seconds of waits that set none.

    Yields:
        The running launch.

    Raises:
        LaunchError: The description is wrong: on entry, or on leaving if it is found later.
        UnknownArgumentError: The description declares no argument of a given name.
        BrokerUnreachable: On leaving: no broker answers at `url`.
        InvalidUrlError: `url` cannot be read.
    """
    async with AsyncExitStack() as stack:
        stack.enter_context(captured_nodes())
        if url is None:
            url = (await stack.enter_async_context(Broker(BrokerOptions(port=0)))).url

        prepared = Launch(
            _described(description),
            arguments=arguments,
            url=url,
            domain=domain,
            environment={**variables_for_tests(), **(environment or {})},
            folder=None if folder is None else Path(folder),
            stop_timeout_sec=stop_timeout_sec,
            watch_graph=True,
        )
        await prepared.prepare()
        run = LaunchRun(prepared, timeout_sec=timeout_sec)
        try:
            yield RunningLaunch(run)
        except BaseException as error:
            await run.stop()
            run.add_note_to(error)
            raise
        await run.stop()
        run.check()


def _described(given: LaunchDescription | str | PathLike[str] | Iterable[Action]) -> LaunchDescription | Path:
    if isinstance(given, LaunchDescription):
        return given
    return Path(given) if isinstance(given, str | PathLike) else LaunchDescription(given)
