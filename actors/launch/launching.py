"""A launch: a description, a broker for it, and what runs of it, put together.

launch = Launch("robot.launch.py", arguments={"speed": "1.5"}, listeners=[print])
good = await launch.run()
"""

from __future__ import annotations

import asyncio
import os
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from actors.config.contexts import find_broker_target
from actors.errors import BrokerUnreachable
from actors.launch.engine.embedded import broker_is_there, can_embed, embedded_broker
from actors.launch.engine.graph_watch import graph_watch
from actors.launch.engine.machine import Machine
from actors.launch.engine.runner import Runner
from actors.launch.engine.worker import call_in_thread
from actors.launch.planning.events import Level, Message
from actors.launch.planning.plan import make_plan
from actors.launch.planning.steps import STOP_TIMEOUT_SEC, awaits_graph
from actors.launch.resources.files import Files
from actors.session.start_hint import start_hint
from broker.errors import AddressInUseError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.config.contexts import BrokerTarget
    from actors.launch.description.description import LaunchDescription
    from actors.launch.description.library import Library
    from actors.launch.planning.events import Event, Listener
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.steps import OutputMode, Step

FIND_TRIES: Final = 5
FIND_PAUSE_SEC: Final = 0.2
"""Where no broker answers and yet none can listen, as others begin and end at the same time."""


class Launch:
    """One launch. It is planned by `plan`, `prepare` or `run`; nothing is started before it is.

    The launch files, their commands and the functions of the description are run in a worker thread, one at a
    time, so that they do not block the event loop.

    Where no broker answers it brings one, which ends with it, if the place is this machine's.

    Args:
        description: What to launch: a description, or the path of a launch file.
        arguments: Launch arguments.
        url: Where the broker is; None: as for nodes.
        domain: Which of its graphs; None: as for nodes.
        context: One of the brokers that have been named; None: as for nodes.
        environment: What programs get, beside where the broker is; None: this process's environment.
        folder: From where relative paths in the description are seen; None: its file's, or this one.
        library: Files and packages; None: this machine's.
        listeners: Told of each event when it happens; they must not wait.
        output: Where the lines of all processes go; None: as the description says.
        stop_timeout_sec: What each step of stopping a process may take, unless it says otherwise.
        keep: Whether to go on when nothing is left to run, until `stop`.
        watch_graph: Whether to follow the graph also if nothing depends on it.

    Raises:
        InvalidUrlError: The URL cannot be read.
        UnknownContextError: There is no such context.

    Attributes:
        place: Where the broker is.
    """

    def __init__(
        self,
        description: LaunchDescription | str | Path,
        *,
        arguments: Mapping[str, str] | None = None,
        url: str | None = None,
        domain: int | None = None,
        context: str | None = None,
        environment: Mapping[str, str] | None = None,
        folder: str | Path | None = None,
        library: Library | None = None,
        listeners: Sequence[Listener] = (),
        output: OutputMode | None = None,
        stop_timeout_sec: float = STOP_TIMEOUT_SEC,
        keep: bool = False,
        watch_graph: bool = False,
    ) -> None:
        self.place = find_broker_target(url, domain, context)
        self._description = description
        self._library: Library = Files() if library is None else library
        self._arguments = arguments or {}
        self._environment = _environment(self.place, environment)
        self._folder = folder
        self._output = output
        self._watch_graph = watch_graph
        self._steps: Sequence[Step] | None = None
        self._planning: asyncio.Future[Sequence[Step]] | None = None
        self._stopped = False
        self._machine = Machine(keep=keep)
        self._listeners = list(listeners)
        self._runner = Runner(self._machine, self._listeners, stop_timeout_sec=stop_timeout_sec)

    def plan(self) -> Sequence[Step]:
        """Plan it, unless that has been done, and return the plan. This blocks, and needs no event loop.

        Raises:
            LaunchError: The description cannot be carried out.
            UnknownArgumentError: Nobody knows an argument that was given.
        """
        if self._steps is None:
            description, folder = self._description, self._folder
            if isinstance(description, str | Path):
                description = self._library.description(str(Path(description).absolute()))
            if folder is None:
                folder = Path(description.file).parent if description.file else Path.cwd()
            self._steps = make_plan(
                description,
                self._library,
                arguments=self._arguments,
                environment=self._environment,
                folder=str(Path(folder).absolute()),
                output=self._output,
            )
        return self._steps

    async def prepare(self) -> Sequence[Step]:
        """Plan it in a worker thread, unless that has been done, and return the plan.

        Raises:
            LaunchError: The description cannot be carried out.
            UnknownArgumentError: Nobody knows an argument that was given.
        """
        if self._steps is None:
            self._planning = call_in_thread(self.plan)
            return await self._planning
        return self._steps

    async def run(self) -> bool:
        """Run it to its end, once. Cancelling it stops everything.

        Returns:
            False if the last execution of a process that ended by itself had an exit code other than 0 or was
            ended by a signal, or if something else failed. Executions that the launch interrupted, to stop or
            restart a process, do not count, whatever their exit code.

        Raises:
            LaunchError: The description cannot be carried out. Nothing has been started.
            UnknownArgumentError: Nobody knows an argument that was given.
            BrokerUnreachable: No broker answers, and none can be started there; or what answers is none.
            CancelledError: It was cancelled; all processes have ended all the same.
        """
        try:
            steps = await self.prepare()
        except asyncio.CancelledError:
            if self._stopped and not cast("asyncio.Task[bool]", asyncio.current_task()).cancelling():
                return True
            raise
        async with AsyncExitStack() as stack:
            await self._find_broker(stack)
            if self._watch_graph or awaits_graph(steps):
                await stack.enter_async_context(graph_watch(self.place, self._runner.graph))
            return await self._runner.run(steps)

    def listen(self, listener: Listener) -> None:
        """From now on tell a listener of each event."""
        self._listeners.append(listener)

    def tell(self, event: Event) -> None:
        """Tell the listeners of something."""
        self._runner.tell(event)

    def stop(self, reason: str, *, insist: bool = True) -> None:
        """Stop it; a second time, a moment later, kill what is left. `run` returns when all has ended.

        Args:
            reason: For people.
            insist: Whether this may be the second time.
        """
        self._stopped = True
        if self._planning is not None:
            self._planning.cancel()
        self._runner.stop(reason, insist=insist)

    def restart(self, label: str, reason: str) -> None:
        """Start a process again, whatever it does now."""
        self._runner.restart(label, reason)

    @property
    def presences(self) -> frozenset[Presence]:
        """What is there, as far as the graph is followed."""
        return self._machine.presences

    @property
    def mistake(self) -> str:
        """What turned out to be wrong with the description while it ran; the first thing, or nothing."""
        return self._machine.mistake

    @property
    def failed(self) -> bool:
        """Whether a required process has died, or the description turned out to be wrong."""
        return self._machine.failed

    async def _find_broker(self, stack: AsyncExitStack) -> None:
        """See to it that there is a broker: one that answers, or else one of this launch."""
        place = self.place
        for tries_left in reversed(range(FIND_TRIES)):
            if await broker_is_there(place.url, place.domain):
                return
            if len(place.urls) != 1 or not can_embed(place.urls[0]):
                urls = ", ".join(map(str, place.urls))
                raise BrokerUnreachable(f"No broker at {urls}. {start_hint(place.urls[0])}")
            try:
                await stack.enter_async_context(embedded_broker(place.urls[0]))
            except AddressInUseError:  # another launch was quicker; or what had it is about to end
                if not tries_left:
                    raise
                await asyncio.sleep(FIND_PAUSE_SEC)
            else:
                self.tell(Message(Level.INFO, f"no broker at {place.url}: this launch brings its own"))
                return


def _environment(place: BrokerTarget, given: Mapping[str, str] | None) -> dict[str, str]:
    """Return what programs get: also where the broker is."""
    base = os.environ if given is None else given
    extra = {"CALLBOARD_URL": place.url, "CALLBOARD_DOMAIN": str(place.domain)}
    return {**base, **extra, "PYTHONUNBUFFERED": "1"}
