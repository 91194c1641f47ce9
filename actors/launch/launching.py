"""A launch: plans a description, finds or starts a broker, and runs the plan.

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
from actors.launch.engine.graph_watch import graph_watch
from actors.launch.engine.machine import Machine
from actors.launch.engine.runner import Runner
from actors.launch.engine.worker import call_in_thread
from actors.launch.planning.events import Level, Message
from actors.launch.planning.plan import make_plan
from actors.launch.planning.process_spec import STOP_TIMEOUT_SEC
from actors.launch.planning.steps import awaits_graph
from actors.launch.resources.files import Files
from actors.processes.local_broker import broker_is_there, can_start_at
from actors.session.start_hint import start_hint
from actors.tools.hidden_node import hidden_name
from broker.errors import AddressInUseError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.config.contexts import BrokerTarget
    from actors.launch.description.description import LaunchDescription
    from actors.launch.description.description_source import LaunchLibrary
    from actors.launch.description.process_actions import OutputMode
    from actors.launch.planning.events import Event, Listener
    from actors.launch.planning.presence import Presence
    from actors.launch.planning.steps import Step
    from broker import Broker
    from proto.wire.url import BrokerUrl

FIND_TRIES: Final = 5
FIND_PAUSE_SEC: Final = 0.2
"""For addresses in use where no broker answers, because other launches begin or end just now."""


class Launch:
    """One launch. `plan`, `prepare` or `run` plan it; nothing is started before that.

    Launch files, their commands and the functions of the description run in a worker thread, one at a time,
    so that they do not block the event loop.

    If no broker answers and the address is on this machine, the launch starts a broker, which ends with it.

    Args:
        description: A description, or the path of a launch file.
        arguments: Launch arguments.
        url: The address of the broker; None: as for nodes.
        domain: The domain; None: as for nodes.
        context: The name of a configured broker; None: as for nodes.
        environment: The environment of programs, to which the address of the broker is added; None: that of
            this process.
        folder: The folder to which paths in the description are relative; None: the folder of its file, or
            the current one.
        library: Finds files and packages; None: those of this machine.
        listeners: Called with each event when it happens; they must not block.
        output: Where the lines of all processes go; None: as the description has it.
        stop_timeout_sec: Seconds between SIGINT, SIGTERM and SIGKILL, for processes without timeouts of
            their own.
        keep: Whether to go on when nothing is left to run, until `stop` is called.
        watch_graph: Whether to follow the graph also if nothing depends on it.

    Raises:
        InvalidUrlError: The URL cannot be read.
        InvalidEnvironmentError: CALLBOARD_DOMAIN is not an integer from 0 to 232.
        ContextError: There is no such context, or the file of contexts is broken.

    Attributes:
        target: The address of the broker and the domain.
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
        library: LaunchLibrary | None = None,
        listeners: Sequence[Listener] = (),
        output: OutputMode | None = None,
        stop_timeout_sec: float = STOP_TIMEOUT_SEC,
        keep: bool = False,
        watch_graph: bool = False,
    ) -> None:
        self.target = find_broker_target(url, domain, context)
        self._description = description
        self._library: LaunchLibrary = Files() if library is None else library
        self._arguments = arguments or {}
        self._environment = _environment(self.target, environment)
        self._folder = folder
        self._output = output
        self._watch_graph = watch_graph
        self._steps: Sequence[Step] | None = None
        self._planning: asyncio.Future[Sequence[Step]] | None = None
        self._stopped = False
        self._machine = Machine(keep=keep)
        self._listeners = list(listeners)
        self._node_name = hidden_name("launch")
        self._runner = Runner(
            self._machine,
            self._listeners,
            target=self.target,
            node_name=self._node_name,
            stop_timeout_sec=stop_timeout_sec,
        )

    def plan(self) -> Sequence[Step]:
        """Plan it, unless that has been done. This blocks, and needs no event loop.

        Returns:
            The steps of the plan.

        Raises:
            LaunchError: The description cannot be carried out.
            UnknownArgumentError: An argument was given that nothing declares or uses.
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
        """Plan it in a worker thread, unless that has been done.

        Returns:
            The steps of the plan.

        Raises:
            LaunchError: The description cannot be carried out.
            UnknownArgumentError: An argument was given that nothing declares or uses.
        """
        if self._steps is None:
            self._planning = call_in_thread(self.plan)
            return await self._planning
        return self._steps

    async def run(self) -> bool:
        """Run it to its end, once. Cancelling it stops everything.

        Returns:
            False if the last run of a process had an exit code other than 0 or was ended by a signal, or if
            something else failed. A run that the launch interrupted, to stop or restart the process, has not
            failed, whatever its exit code.

        Raises:
            LaunchError: The description cannot be carried out. Nothing has been started.
            UnknownArgumentError: An argument was given that nothing declares or uses.
            BrokerUnreachable: No broker answers, and none can be started at the address; or something else
                answers.
            CancelledError: It was cancelled; all processes have ended nevertheless.
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
                await stack.enter_async_context(graph_watch(self.target, self._node_name, self._runner.graph))
            return await self._runner.run(steps)

    def listen(self, listener: Listener) -> None:
        """Add a listener.

        Args:
            listener: Called with each event from now on; it must not block.
        """
        self._listeners.append(listener)

    def notify(self, event: Event) -> None:
        """Pass an event to the listeners.

        Args:
            event: The event.
        """
        self._runner.notify(event)

    def stop(self, reason: str, *, escalate: bool = True) -> None:
        """Stop all processes; a second call, a moment later, kills them. `run` returns when they have ended.

        Args:
            reason: The reason, for messages.
            escalate: Whether a second call kills the processes.
        """
        self._stopped = True
        if self._planning is not None:
            self._planning.cancel()
        self._runner.stop(reason, escalate=escalate)

    def restart(self, label: str, reason: str) -> None:
        """Start a process again, whatever its state.

        Args:
            label: Its label, such as "talker-1". An unknown one is ignored.
            reason: The reason, for messages.
        """
        self._runner.restart(label, reason)

    @property
    def presences(self) -> frozenset[Presence]:
        """The nodes, topics and services in the graph, if the launch follows it."""
        return self._machine.presences

    @property
    def error(self) -> str:
        """The first error in the description that was found while it ran; empty if there is none."""
        return self._machine.error

    @property
    def failed(self) -> bool:
        """Whether a required process has died, or an error was found in the description."""
        return self._machine.failed

    async def _find_broker(self, stack: AsyncExitStack) -> None:
        """Find a broker that answers, or start one."""
        target = self.target
        for tries_left in reversed(range(FIND_TRIES)):
            if await broker_is_there(target):
                return
            if len(target.urls) != 1 or not can_start_at(target.urls[0]):
                urls = ", ".join(map(str, target.urls))
                raise BrokerUnreachable(f"No broker at {urls}. {start_hint(target.urls[0])}")
            try:
                await stack.enter_async_context(_embedded_broker(target.urls[0]))
            except AddressInUseError:  # another launch was quicker; or what had it is about to end
                if not tries_left:
                    raise
                await asyncio.sleep(FIND_PAUSE_SEC)
            else:
                self.notify(
                    Message(Level.INFO, f"no broker at {target.url}: this launch starts one of its own")
                )
                return


def _embedded_broker(url: BrokerUrl) -> Broker:
    """Return a broker for this address, to be run in this process."""
    from broker import Broker, BrokerOptions  # noqa: PLC0415 - seldom needed

    return Broker(
        BrokerOptions(unix=Path(url.path)) if url.path else BrokerOptions(host=url.host, port=url.port)
    )


def _environment(target: BrokerTarget, given: Mapping[str, str] | None) -> dict[str, str]:
    """Return the environment of programs, with the address of the broker."""
    base = os.environ if given is None else given
    extra = {"CALLBOARD_URL": target.url, "CALLBOARD_DOMAIN": str(target.domain)}
    # With a URL given, they would not read the files from the context.
    return {**base, **extra, **target.credentials.variables(), "PYTHONUNBUFFERED": "1"}
