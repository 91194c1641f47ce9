"""Restarts processes when their source files change.

`watchfiles` waits in a thread for changes that the system reports. Folders are watched one by one, not
recursively, so that ignored folders cost nothing.
"""

from __future__ import annotations

import asyncio
import logging
import os
import threading
from contextlib import asynccontextmanager, closing, suppress
from functools import partial
from importlib.util import find_spec
from itertools import chain
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Final

from actors.launch.engine.sources import MAX_FOLDERS, Sources
from actors.launch.engine.worker import call_in_thread
from actors.launch.errors import LaunchError
from actors.launch.planning.events import Level, Message, ProcessExited, ProcessStarted
from actors.launch.planning.steps import Start
from actors.logging.severity import ROOT_NAME
from proto.extras import install_command
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Collection, Generator, Iterable, Sequence

    from watchfiles import Change

    from actors.launch.planning.events import Event, Listener
    from actors.launch.planning.steps import Step


QUIET_MS: Final = 100
"""Changes within this time of each other count as one, because editors write a file in pieces."""
LONGEST_MS: Final = 2000
"""The longest time over which changes count as one."""
POLL_INTERVAL_MS: Final = 100
"""How soon watching begins, and a process that is added later is noticed."""
END_TIMEOUT_SEC: Final = 3.0
"""How long to wait for the thread at the end: it notices within `QUIET_MS`, unless a file system hangs."""
OFF: Final = "changed processes are not restarted any more"


class SourceWatch:
    """Restarts processes when their sources change. As a listener it also finds processes that start later.

    Args:
        steps: The steps of the launch. The processes that they start are watched from the beginning.
        launch_files: Launch files, whose changes are only reported, because they need a new launch. The
            collection may grow while the launch runs.
        restart: Called in the event loop with a label and the reason.
        notify: Called in the event loop with messages.
    """

    def __init__(
        self,
        steps: Iterable[Step],
        *,
        launch_files: Collection[str],
        restart: Callable[[str, str], None],
        notify: Listener,
    ) -> None:
        self._sources = Sources(launch_files)
        for step in steps:
            if isinstance(step, Start):
                self._sources.add(step.process)
        self._restart = restart
        self._notify = notify
        self._loop: asyncio.AbstractEventLoop | None = None
        self._folders = -1
        self._source_added = threading.Event()
        self._over = threading.Event()

    def on_event(self, event: Event) -> None:
        """Handle an event of the launch."""
        if isinstance(event, ProcessStarted) and self._sources.add(event.process):
            self._source_added.set()
        # Those of the file stay: a change is what starts them again after they have died.
        if isinstance(event, ProcessExited) and event.process.made_later:
            self._sources.forget(event.process)

    @asynccontextmanager
    async def running(self) -> AsyncGenerator[None]:
        """Watch within the context. Changes after entering are noticed.

        Raises:
            LaunchError: watchfiles is not installed, or the system cannot watch these folders.
        """
        if find_spec("watchfiles") is None:
            raise LaunchError(f"Watching sources needs watchfiles: {install_command('watch')}")
        self._loop = asyncio.get_running_loop()
        changes = await call_in_thread(self._begin)
        watching = call_in_thread(partial(self._watch, changes))
        watching.add_done_callback(self._ended)
        try:
            yield
        finally:
            self._over.set()
            # A thread cannot be cancelled; on a file system that hangs it is left behind.
            await asyncio.wait({watching}, timeout=END_TIMEOUT_SEC)
            watching.cancel()

    # In the thread

    def _begin(self) -> Generator[set[str]]:
        """Start to watch the current folders, and report their number.

        Raises:
            LaunchError: The system cannot watch them.
        """
        # Before the folders are read: a process that is added meanwhile leads to another round.
        self._source_added.clear()
        folders = self._sources.folders()
        changes = _changes(folders, self._over)
        next(changes)  # until the system watches them
        if len(folders) != self._folders:
            self._folders = len(folders)
            text = f"watching {_number(len(folders), 'folder')} for changes"
            full = len(folders) == MAX_FOLDERS
            level, more = (Level.WARN, "; more cannot be watched") if full else (Level.INFO, "")
            self._call(self._send_message, level, text + more)
        return changes

    def _watch(self, watched: Generator[set[str]]) -> None:
        """Report changes until the watch is over.

        Raises:
            LaunchError: The system cannot watch any longer.
        """
        try:
            while not self._over.is_set():
                changes = next(watched, set[str]())
                if self._source_added.is_set() or any(Path(path).is_dir() for path in changes):
                    # The new watch begins before the old one ends, so that no change is missed.
                    before, watched = watched, self._begin()
                    changes |= next(before, set[str]())
                    before.close()
                if changes:
                    self._call(self._changed, changes)
        finally:
            watched.close()

    def _call(self, function: Callable[..., None], *arguments: object) -> None:
        assert self._loop is not None
        with suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the loop

    def _ended(self, watching: asyncio.Future[None]) -> None:
        error = None if watching.cancelled() else watching.exception()
        if isinstance(error, LaunchError):
            self._send_message(Level.ERROR, f"{error}; {OFF}")
        elif error is not None:  # a bug
            logging.getLogger(ROOT_NAME).error("Watching sources has failed; %s", OFF, exc_info=error)

    def _changed(self, paths: set[str]) -> None:
        changed: dict[str, list[str]] = {}
        for path in sorted(paths):
            if self._sources.is_launch_file(path):
                name = escape(PurePath(path).name)
                self._send_message(Level.WARN, f"{name} has changed: start the launch again to see that")
                continue
            for label in self._sources.labels_of(path):
                changed.setdefault(label, []).append(path)
        for label, files in changed.items():
            self._restart(label, _reason(files))

    def _send_message(self, level: Level, text: str) -> None:
        self._notify(Message(level, text))


def _changes(folders: Sequence[str], stop: threading.Event) -> Generator[set[str]]:
    """Yield nothing once the folders are watched, and then every `POLL_INTERVAL_MS` what has changed.

    Raises:
        LaunchError: The system cannot watch the folders, or does not report changes any more.
    """
    from watchfiles import watch  # noqa: PLC0415 - optional

    batches = watch(
        *folders,
        watch_filter=None,  # `Sources` decides, also about launch files with other suffixes
        debounce=LONGEST_MS,
        step=QUIET_MS,
        stop_event=stop,
        rust_timeout=POLL_INTERVAL_MS,
        yield_on_timeout=True,
        force_polling=False,  # an error is better than a loop that reads all folders again and again
        recursive=False,
        ignore_permission_denied=True,
    )
    try:
        with closing(batches):
            first: Iterable[tuple[Change, str]] = next(batches, ())
            yield set()
            for batch in chain([first], batches):
                yield {os.path.realpath(path) for _, path in batch}
        if not stop.is_set():
            raise RuntimeError("watchfiles reports no more changes")
    except (OSError, RuntimeError) as error:
        raise LaunchError(f"Sources cannot be watched: {escape(str(error))}") from error


def _reason(files: list[str]) -> str:
    name = escape(PurePath(files[0]).name)
    if len(files) == 1:
        return f"{name} has changed"
    return f"{name} and {_number(len(files) - 1, 'other file')} have changed"


def _number(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
