"""Log files: who is in which, and what becomes of lines that cannot be written."""

from __future__ import annotations

import errno
import re
import threading
from functools import partial
from typing import TYPE_CHECKING

import pytest

from actors.launch.description.process_actions import OutputMode
from actors.launch.output import writer
from actors.launch.output.log_files import LogFiles
from actors.launch.output.log_folder import LogFolder
from actors.launch.planning.events import Event, Level, Message, ShuttingDown, Stream
from tests.actors.launch.event_samples import exited, spec, started, wrote
from tests.actors.launch.output.threads import join_threads

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

DEADLINE_SEC = 30.0
STAMP = r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z "


def logged(root: Path, *events: Event) -> tuple[dict[str, str], Sequence[Event]]:
    """Return the files, stamps replaced, that events leave behind, and what was told."""
    told: list[Event] = []
    logs = LogFiles(partial(LogFolder, root), told.append)
    for event in events:
        logs(event)
    assert logs.close(DEADLINE_SEC)
    folders = [each for each in root.iterdir() if not each.is_symlink()] if root.exists() else []
    return {
        each.name: re.sub(STAMP, "@ ", each.read_bytes().decode())
        for folder in folders
        for each in folder.iterdir()
    }, told


@pytest.mark.parametrize("mode", list(OutputMode))
def test_the_mode_says_which_files(tmp_path: Path, mode: OutputMode) -> None:
    """One for all, one for each process, or both; stdout and stderr apart where they are known apart."""
    talker = spec(output=mode)
    files, _ = logged(
        tmp_path,
        started(talker),
        wrote(talker, b"out", b"\x1b[1;31mred\x1b[0m\x1b]0;title\x07", stream=Stream.STDOUT),
        wrote(talker, b"err", stream=Stream.STDERR),
        wrote(talker, b"both", stream=Stream.OUTPUT),
    )
    launch = "@ [INFO] [talker-1]: process started with pid [7]\n"
    if mode in {OutputMode.LOG, OutputMode.BOTH, OutputMode.FULL}:
        launch += "".join(f"@ [talker-1] {line}\n" for line in ("out", "red", "err", "both"))
    expected = {}
    if mode is not OutputMode.SCREEN:
        expected["launch.log"] = launch
    if mode in {OutputMode.OWN_LOG, OutputMode.FULL}:
        expected["talker-1.log"] = "out\nred\nerr\nboth\n"
        expected["talker-1-stdout.log"] = "out\nred\n"
        expected["talker-1-stderr.log"] = "err\n"
    assert files == expected


def test_files_are_made_when_a_process_wants_them(tmp_path: Path) -> None:
    """What was said before is in them, too; it is told where they are."""
    screen, log = spec("a-1"), spec("b-2", output=OutputMode.LOG)
    files, told = logged(
        tmp_path,
        Message(Level.INFO, "hello\x07"),
        started(screen),
        wrote(screen, b"not here"),
        started(log),
        exited(screen, 1),
        ShuttingDown("enough"),
    )
    assert files["launch.log"].splitlines() == [
        "@ [INFO] [launch]: hello\\x07",
        "@ [INFO] [a-1]: process started with pid [7]",
        "@ [INFO] [b-2]: process started with pid [7]",
        "@ [ERROR] [a-1]: process has died [pid 7, exit code 1, cmd 'talker 'a b'']",
        "@ [INFO] [launch]: stopping: enough",
    ]
    (message,) = told
    assert isinstance(message, Message)
    assert message.text == f"log files are in {(tmp_path / 'latest').resolve()}"


def test_nothing_is_made_if_nobody_wants_it(tmp_path: Path) -> None:
    """No folder, and no word."""
    root = tmp_path / "log"
    assert logged(root, started(spec()), wrote(spec(), b"x")) == ({}, [])
    assert not root.exists()


def test_labels_are_made_safe_for_files(tmp_path: Path) -> None:
    """They stay apart, since the number stays."""
    labels = ("../../etc/x-1", ".hidden-2", "n" * 300 + "-3")
    files, _ = logged(tmp_path, *(wrote(spec(each, output=OutputMode.OWN_LOG), b"x") for each in labels))
    assert sorted(files) == ["_._.._etc_x-1.log", "_hidden-2.log", "n" * 48 + "-3.log"]


def test_files_that_cannot_be_made_are_reported_once(tmp_path: Path) -> None:
    """The launch goes on; what is missing is counted."""
    (tmp_path / "file").touch()
    told: list[Event] = []
    logs = LogFiles(partial(LogFolder, tmp_path / "file" / "log"), told.append)
    talker = spec(output=OutputMode.LOG)
    for event in (started(talker), wrote(talker, b"a", b"b"), exited(talker, 0)):
        logs(event)
    assert not logs.close(DEADLINE_SEC)
    where = tmp_path / "file" / "log"
    assert told == [
        Message(Level.ERROR, f"log files in {where} cannot be written: Not a directory"),
        Message(Level.WARN, "4 lines are missing in the log files"),
    ]


def test_a_full_disk_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 42: what cannot be written is counted; when there is room again, files go on."""
    write = LogFolder.write
    full = {b"2", b"3"}

    def write_if_room(folder: LogFolder, name: str, data: bytes) -> None:
        if data.split()[-1] in full:
            raise OSError(errno.ENOSPC, "No space left on device")
        write(folder, name, data)

    monkeypatch.setattr(LogFolder, "write", write_if_room)
    told: list[Event] = []
    logs = LogFiles(partial(LogFolder, tmp_path), told.append)
    talker = spec(output=OutputMode.OWN_LOG)
    for number in range(1, 5):
        logs(wrote(talker, b"%d" % number))
    assert not logs.close(DEADLINE_SEC)
    assert (tmp_path / "latest" / "talker-1.log").read_bytes() == b"1\n4\n"
    texts = [each.text for each in told if isinstance(each, Message)]
    assert texts[1].endswith("cannot be written: No space left on device")
    assert texts[2:] == ["2 lines are missing in the log files"]


def test_lines_that_come_too_fast_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The log says how many there were, as the launch does in the end."""
    monkeypatch.setattr(writer, "MAX_QUEUED_BYTES", 100)
    told: list[Event] = []
    logs = LogFiles(partial(LogFolder, tmp_path), told.append)
    talker = spec(output=OutputMode.LOG)
    logs(wrote(talker, b"x" * 101, b"y"))
    assert not logs.close(DEADLINE_SEC)
    log = (tmp_path / "latest" / "launch.log").read_text()
    assert log.endswith(" [WARN] [launch]: 2 lines are missing: they came too fast\n")
    assert told[-1] == Message(Level.WARN, "2 lines are missing in the log files")


def test_closing_does_not_wait_for_a_disk_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the time that it is given; that is reported."""
    free = threading.Event()
    monkeypatch.setattr(LogFolder, "write", lambda *_: free.wait(DEADLINE_SEC))
    told: list[Event] = []
    logs = LogFiles(partial(LogFolder, tmp_path), told.append)
    logs(wrote(spec(output=OutputMode.LOG), b"x"))
    assert not logs.close(0.01)
    free.set()
    join_threads("launch log files")
    assert Message(Level.WARN, "the log files end early: they cannot be written fast enough") in told
