"""Watching sources: real files change, and the processes that they belong to are started again."""

from __future__ import annotations

import asyncio
import re
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from actors.launch.engine.captured_output import launch_logs
from actors.launch.engine.watching import OFF, SourceWatch
from actors.launch.errors import LaunchError
from actors.launch.planning.events import Event, Level, Message, ProcessStarted
from actors.launch.planning.process_spec import ProcessSpec
from actors.launch.planning.steps import Start
from proto.extras import install_command
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path


class Witness:
    """Sees what a watch does.

    Attributes:
        watch: It watches the sources of these processes.
        said: Its messages, and restarts as "label: reason".
    """

    def __init__(self, *processes: ProcessSpec, launch_files: tuple[Path, ...] = ()) -> None:
        self.said: list[str] = []
        self._more = asyncio.Event()
        self.watch = SourceWatch(
            [Start(process=each) for each in processes],
            launch_files=[str(each) for each in launch_files],
            restart=lambda label, reason: self._add(f"{label}: {reason}"),
            notify=self._notify,
        )

    async def sees(self, *texts: str) -> None:
        """Wait until all of this was reported, and forget all that has."""
        while not set(texts) <= set(self.said):
            self._more.clear()
            await self._more.wait()
        self.said.clear()

    def _notify(self, event: Event) -> None:
        assert isinstance(event, Message)
        self._add(event.text)

    def _add(self, text: str) -> None:
        self.said.append(text)
        self._more.set()


def process(label: str, *made_of: Path) -> ProcessSpec:
    """Return a process that is made of something."""
    return ProcessSpec(
        label=label, name=label, command=("program",), shown=label, sources=tuple(map(str, made_of))
    )


async def test_a_change_restarts_who_it_belongs_to(tmp_path: Path) -> None:
    """Those whose folder the file is in, and no others; a file that is replaced has changed."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "main.py").write_text("1")
    witness = Witness(process("one-1", tmp_path / "one"), process("two-2", tmp_path / "two"))
    async with witness.watch.running():
        await witness.sees("watching 2 folders for changes")
        (tmp_path / "one" / "main.py").write_text("2")
        await witness.sees("one-1: main.py has changed")
        (tmp_path / "two" / "new").write_text("2")
        (tmp_path / "two" / "new").replace(tmp_path / "two" / "main.py")
        await witness.sees("two-2: main.py has changed")


async def test_changes_at_the_same_time_are_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As an editor saves them all."""
    set_limits(monkeypatch, watching_quiet_ms=1000)  # a busy machine may take a while between two files
    witness = Witness(process("one-1", tmp_path))
    async with witness.watch.running():
        for name in ("b.py", "a.py", "c.yaml"):
            (tmp_path / name).touch()
        await witness.sees("one-1: a.py and 2 other files have changed")


async def test_folders_that_come_later_are_watched(tmp_path: Path) -> None:
    """Within a source; what is there then already is not seen."""
    witness = Witness(process("one-1", tmp_path))
    async with witness.watch.running():
        (tmp_path / "inner").mkdir()
        await witness.sees("watching 2 folders for changes")
        (tmp_path / "inner" / "module.py").touch()
        await witness.sees("one-1: module.py has changed")


async def test_processes_that_come_later_are_watched(tmp_path: Path) -> None:
    """What a handler or a function starts is known when it has started."""
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    witness = Witness(process("one-1", first))
    async with witness.watch.running():
        witness.watch.on_event(ProcessStarted(process("two-2", second), 1))
        (first / "main.py").touch()
        await witness.sees("one-1: main.py has changed", "watching 2 folders for changes")
        (second / "main.py").touch()
        await witness.sees("two-2: main.py has changed")


async def test_a_launch_file_cannot_be_carried_out_again(tmp_path: Path) -> None:
    """That is reported; those in whose folder it is are left alone."""
    file = tmp_path / "robot.launch.py"
    witness = Witness(process("one-1", tmp_path), launch_files=(file,))
    async with witness.watch.running():
        file.write_text("new")
        await witness.sees("robot.launch.py has changed: start the launch again to see that")
        (tmp_path / "main.py").touch()
        await witness.sees("one-1: main.py has changed")


class Looks:
    """Stands in for `watchfiles.watch`: finds nothing until told to end.

    Attributes:
        error: What it raises at the end; None: it ends as an iterator does.
    """

    def __init__(self, error: BaseException | None) -> None:
        self.error = error
        self._end = threading.Event()

    def watch(self, *folders: str, **options: object) -> Generator[set[tuple[object, str]]]:
        """Yield nothing, twice; then end as soon as `end` is called."""
        yield set()
        yield set()
        assert self._end.wait(30)
        if self.error is not None:
            raise self.error

    def end(self) -> None:
        """Let it end."""
        self._end.set()


@pytest.mark.parametrize("error", [None, RuntimeError("inotify is gone")])
async def test_a_watch_that_ends_is_one_error_line(
    error: BaseException | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether watchfiles raises or just stops; the thread ends, instead of asking it again and again."""
    looks = Looks(error)
    monkeypatch.setattr("watchfiles.watch", looks.watch)
    witness = Witness(process("one-1", tmp_path))
    reason = error or "watchfiles reports no more changes"
    async with asyncio.timeout(30), witness.watch.running():
        await witness.sees("watching 1 folder for changes")
        looks.end()
        await witness.sees(f"Sources cannot be watched: {reason}; {OFF}")


async def test_a_bug_in_the_watch_is_logged_with_its_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A launch shows it: an error line says that changes restart nothing any more. The launch goes on."""

    class PanicException(BaseException):
        """What a panic in a Rust extension is."""

    looks = Looks(PanicException("out of luck"))
    monkeypatch.setattr("watchfiles.watch", looks.watch)
    witness = Witness(process("one-1", tmp_path))
    said: list[Event] = []
    logged = asyncio.Event()

    def notify(event: Event) -> None:
        said.append(event)
        logged.set()

    async with asyncio.timeout(30):
        with launch_logs(notify):
            async with witness.watch.running():
                looks.end()
                await logged.wait()
    (message,) = said
    assert isinstance(message, Message)
    first, *traceback = message.text.split("\n")
    assert (message.level, first) == (Level.ERROR, f"Watching sources has failed; {OFF}")
    assert traceback[0] == "Traceback (most recent call last):"
    assert traceback[-1].endswith("PanicException: out of luck")


async def test_leaving_does_not_wait_for_a_thread_that_hangs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as one that reads a file system that does not answer: it is abandoned."""
    looks = Looks(None)
    monkeypatch.setattr("watchfiles.watch", looks.watch)
    set_limits(monkeypatch, watching_end_sec=0.01)
    witness = Witness(process("one-1", tmp_path))
    async with asyncio.timeout(20):
        async with witness.watch.running():
            await witness.sees("watching 1 folder for changes")
    assert witness.said == []
    looks.end()


async def test_without_watchfiles_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is an extra."""
    monkeypatch.setitem(sys.modules, "watchfiles", None)
    monkeypatch.setattr("actors.launch.engine.watching.find_spec", lambda _: None)
    with pytest.raises(LaunchError, match=re.escape(install_command("watch"))):
        async with Witness().watch.running():
            pass


async def test_it_needs_only_the_public_names_of_watchfiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its private module may change with each release."""
    import watchfiles  # noqa: PLC0415 - has to be loaded before its module is hidden

    assert watchfiles.__name__
    monkeypatch.setitem(sys.modules, "watchfiles._rust_notify", None)
    witness = Witness(process("one-1", tmp_path))
    async with witness.watch.running():
        (tmp_path / "main.py").touch()
        await witness.sees("one-1: main.py has changed")
