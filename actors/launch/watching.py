"""Watching: a process starts again when a file that it is made of changes.

The system reports changes to `watchfiles`, which waits for them in a thread. Folders are watched each for
itself, so that those which do not count cost nothing.
"""

from __future__ import annotations

import asyncio
import os
import threading
from contextlib import asynccontextmanager, suppress
from importlib.util import find_spec
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Final

from actors.launch.errors import LaunchError
from actors.launch.events import Level, Message, ProcessExited, ProcessStarted
from actors.launch.sources import MAX_FOLDERS, Sources
from actors.launch.steps import Start
from proto.errors import shown

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Collection, Iterable

    from watchfiles._rust_notify import RustNotify

    from actors.launch.events import Event, Listener
    from actors.launch.steps import Step

MISSING: Final = "Watching sources needs watchfiles: pip install 'callboard[watch]'"

QUIET_MS: Final = 100
"""Changes that come within this time of each other are one: a program that is saved is written in pieces."""
LONGEST_MS: Final = 2000
"""How long changes may go on until they are one all the same."""
LOOK_MS: Final = 500
"""How soon a process that comes later is watched: telling watchfiles earlier would lose changes."""


class SourceWatch:
    """Restarts processes whose sources change. As a listener of a launch it learns of those that come later.

    Args:
        steps: Of the launch: its processes are watched from the beginning.
        launch_files: Files whose changes cannot be carried out; that is said instead. More may be added.
        restart: Called in the loop with a label and the reason.
        tell: Gets messages, in the loop.
    """

    def __init__(
        self,
        steps: Iterable[Step],
        *,
        launch_files: Collection[str],
        restart: Callable[[str, str], None],
        tell: Listener,
    ) -> None:
        self._sources = Sources(launch_files)
        for step in steps:
            if isinstance(step, Start):
                self._sources.add(step.process)
        self._restart = restart
        self._tell = tell
        self._loop: asyncio.AbstractEventLoop | None = None
        self._folders = -1
        self._stirred = threading.Event()
        self._over = threading.Event()

    def heard(self, event: Event) -> None:
        """Something has happened in the launch."""
        if isinstance(event, ProcessStarted) and self._sources.add(event.process):
            self._stirred.set()
        if isinstance(event, ProcessExited) and event.process.made_later:
            self._sources.forget(event.process)

    @asynccontextmanager
    async def running(self) -> AsyncGenerator[None]:
        """Watch meanwhile. What changes from the entry on is seen.

        Raises:
            LaunchError: watchfiles is not installed, or the system cannot watch these folders.
        """
        if find_spec("watchfiles") is None:
            raise LaunchError(MISSING)
        self._loop = asyncio.get_running_loop()
        notify = await asyncio.to_thread(self._notify)
        thread = threading.Thread(target=self._watch, args=(notify,), name="launch sources", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._over.set()
            await asyncio.to_thread(thread.join)

    # In the thread

    def _notify(self) -> RustNotify:
        """Begin to watch what is to be watched now, and say how much that is.

        Raises:
            LaunchError: The system cannot.
        """
        # The generators of watchfiles do not say when they have begun to watch.
        from watchfiles._rust_notify import RustNotify, WatchfilesRustInternalError  # noqa: PLC0415 - optional

        self._stirred.clear()
        folders = self._sources.folders()
        try:
            notify = RustNotify(
                folders,
                debug=False,
                force_polling=False,
                poll_delay_ms=0,
                recursive=False,
                ignore_permission_denied=True,
            )
        except (OSError, WatchfilesRustInternalError) as error:
            raise LaunchError(f"Sources cannot be watched: {shown(str(error))}") from error
        if len(folders) != self._folders:
            self._folders = len(folders)
            text = f"watching {_number(len(folders), 'folder')} for changes"
            full = len(folders) == MAX_FOLDERS
            self._later(
                Level.WARN if full else Level.INFO, f"{text}; more cannot be watched" if full else text
            )
        return notify

    def _watch(self, notify: RustNotify) -> None:
        try:
            while not self._over.is_set():
                changes = self._changes(notify, LOOK_MS)
                if self._stirred.is_set() or any(Path(path).is_dir() for path in changes):
                    # The new one first, so that nothing is missed.
                    before, notify = notify, self._notify()
                    changes |= self._changes(before, 1)
                    before.close()
                if changes:
                    self._call(self._changed, changes)
        except LaunchError as error:
            self._later(Level.ERROR, f"{error}; changes are not seen any more")
        finally:
            notify.close()

    def _changes(self, notify: RustNotify, timeout_ms: int) -> set[str]:
        """Wait for changes; return nothing if none come in time, or this is the end.

        Raises:
            LaunchError: The system does not report them any more.
        """
        from watchfiles._rust_notify import WatchfilesRustInternalError  # noqa: PLC0415 - optional

        try:
            found = notify.watch(LONGEST_MS, QUIET_MS, timeout_ms, self._over)
        except WatchfilesRustInternalError as error:
            raise LaunchError(f"Sources cannot be watched: {shown(str(error))}") from error
        return set() if isinstance(found, str) else {os.path.realpath(path) for _, path in found}

    def _later(self, level: Level, text: str) -> None:
        self._call(self._say, level, text)

    def _call(self, function: Callable[..., None], *arguments: object) -> None:
        assert self._loop is not None
        with suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the loop

    def _changed(self, paths: set[str]) -> None:
        changed: dict[str, list[str]] = {}
        for path in sorted(paths):
            if self._sources.describes(path):
                name = shown(PurePath(path).name)
                self._say(Level.WARN, f"{name} has changed: start the launch again to see that")
                continue
            for label in self._sources.made_of(path):
                changed.setdefault(label, []).append(path)
        for label, files in changed.items():
            self._restart(label, _reason(files))

    def _say(self, level: Level, text: str) -> None:
        self._tell(Message(level, text))


def _reason(files: list[str]) -> str:
    name = shown(PurePath(files[0]).name)
    if len(files) == 1:
        return f"{name} has changed"
    return f"{name} and {_number(len(files) - 1, 'other file')} have changed"


def _number(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
