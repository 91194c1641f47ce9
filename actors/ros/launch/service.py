"""`LaunchService`: runs descriptions from a program."""

from __future__ import annotations

import asyncio
import signal
import sys
from typing import TYPE_CHECKING, Final

from actors.launch import Launch, LaunchError
from actors.launch.output.log_files import LogFiles
from actors.launch.output.screen import Screen
from actors.ros.launch.context import LaunchContext
from actors.ros.launch.description import LaunchDescription
from actors.ros.launch.library import ros_files
from actors.runtime.loop_watch import watch_loop

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch import LaunchDescription as CallboardDescription

LAST_LINES_SEC: Final = 2.0
"""How long the last lines may take when a disk hangs."""


class LaunchService:
    """Runs descriptions, one launch for all that have been included.

    Args:
        argv: Launch arguments, as `name:=value`.
        noninteractive: Ignored.
        debug: Ignored.

    Attributes:
        context: For programs that evaluate substitutions.
    """

    def __init__(
        self, *, argv: Iterable[str] | None = None, noninteractive: bool = False, debug: bool = False
    ) -> None:
        self.context = LaunchContext()
        self._arguments = dict(_argument(each) for each in argv or () if ":=" in each)
        self._description = LaunchDescription()
        self._launch: Launch | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def include_launch_description(self, launch_description: CallboardDescription) -> None:
        """Add a description, before `run`.

        Raises:
            LaunchError: The launch runs already.
        """
        if self._launch is not None:
            raise LaunchError("include_launch_description: the launch runs already")
        self._description.add_entity(launch_description)
        self._description.file = self._description.file or launch_description.file

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Run until the launch ends. Call it in the main thread, so that Ctrl-C and SIGTERM end it.

        Args:
            shutdown_when_idle: Whether it ends when nothing is left to run.

        Returns:
            0, or 1 if the description has an error or a process has failed.
        """
        return asyncio.run(self.run_async(shutdown_when_idle=shutdown_when_idle))

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """Do the same as `run` in a loop that runs."""
        screen = Screen(_write, color=False)
        library = ros_files()
        logs = LogFiles(library.open_log_folder, screen)
        self._loop = asyncio.get_running_loop()
        self._launch = launch = Launch(
            self._description,
            arguments=self._arguments,
            library=library,
            listeners=[screen, logs],
            keep=not shutdown_when_idle,
        )
        for number in (signal.SIGINT, signal.SIGTERM):
            try:
                self._loop.add_signal_handler(number, launch.stop, f"signal {number.name}")
            except (RuntimeError, ValueError):  # not in the main thread, which alone gets signals
                break
        try:
            with watch_loop():
                return 0 if await launch.run() else 1
        except LaunchError as error:
            print(f"[ERROR] [launch]: {error}", file=sys.stderr)  # noqa: T201 - as ROS 2 does
            return 1
        finally:
            logs.close(LAST_LINES_SEC)

    def shutdown(self, force_sync: bool = False) -> None:
        """End the launch, from any thread."""
        if self._launch is not None and self._loop is not None:
            self._loop.call_soon_threadsafe(self._launch.stop, "shutdown was called")


def _argument(word: str) -> tuple[str, str]:
    name, _, value = word.partition(":=")
    return name, value


def _write(data: bytes) -> None:
    sys.stdout.flush()
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()
