"""What `callboard launch` shows and writes: lines or JSON, a status line on terminals, log files."""

from __future__ import annotations

import json
import os
import select
import struct
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.cli.commands.launch.reports import Reports
from actors.launch.description.process_actions import OutputMode
from actors.launch.planning.events import ShuttingDown, Stream
from actors.launch.resources.files import Files
from tests.actors.launch.event_samples import exited, spec, started, wrote

if TYPE_CHECKING:
    from collections.abc import Iterator

fcntl = pytest.importorskip("fcntl")
termios = pytest.importorskip("termios")

DEADLINE_SEC = 30.0


class Terminal:
    """A terminal."""

    def __init__(self) -> None:
        self._here, inside = os.openpty()
        self.stdout = os.fdopen(inside, "w")

    def resize(self, columns: int) -> None:
        """Make it so wide."""
        fcntl.ioctl(self.stdout, termios.TIOCSWINSZ, struct.pack("HHHH", 30, columns, 0, 0))

    def shows(self, wanted: str) -> str:
        """Read until something is there; return all of it."""
        got = ""
        while wanted not in got:
            ready, _, _ = select.select([self._here], [], [], DEADLINE_SEC)
            assert ready, f"{wanted!r} is not shown: {got!r}"
            got += os.read(self._here, 65536).decode()
        return got

    def close(self) -> None:
        """End it."""
        self.stdout.close()
        os.close(self._here)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Terminal]:
    """A terminal that can do all that is needed."""
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    yield terminal
    terminal.close()


def test_a_terminal_has_a_status_line(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Below the last line, cut to the terminal's width, and gone in the end; labels have colours."""
    monkeypatch.setattr(sys, "stdout", terminal.stdout)
    reports = Reports(Files().open_log_folder, json=False, on_closed=lambda: None)
    terminal.resize(12)
    one = spec("a-1")
    reports(started(one))
    terminal.shows("[INFO] \x1b[36m[a-1]\x1b[0m: process started with pid [7]\r\n\x1b[32m1 up\x1b[0m · Ctrl")
    reports(wrote(one, b"hello"))
    terminal.shows("\r\x1b[K\x1b[36m[a-1]\x1b[0m hello\r\n\x1b[32m1 up\x1b[0m · Ctrl")
    terminal.resize(200)
    reports(ShuttingDown("enough"))
    terminal.shows("[INFO] [launch]: stopping: enough\r\nstopping: 1 left · Ctrl-C again kills")
    reports.close(0)
    terminal.shows("\r\x1b[K")


@pytest.mark.parametrize("variable", ["TERM=dumb", "NO_COLOR=1"])
def test_colors_and_the_status_line_are_by_wish(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    """A dumb terminal has neither, and NO_COLOR takes the colours alone."""
    name, _, value = variable.partition("=")
    monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stdout", terminal.stdout)
    reports = Reports(Files().open_log_folder, json=False, on_closed=lambda: None)
    reports(started(spec("a-1")))
    reports(exited(spec("a-1"), 0))
    reports.close(0)
    terminal.stdout.write("end")
    terminal.stdout.flush()
    got = terminal.shows("end")
    assert ("Ctrl-C stops" in got) is (name == "NO_COLOR")
    assert "\x1b[3" not in got
    assert "[INFO] [a-1]: process started with pid [7]\r\n" in got


def test_other_places_get_lines(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """A pipe or a file has no status line, and colours only if they are wished for."""
    for wish in ("", "1"):
        monkeypatch.setenv("FORCE_COLOR", wish)
        reports = Reports(Files().open_log_folder, json=False, on_closed=lambda: None)
        reports(wrote(spec("a-1"), b"hello"))
        reports.close(0)
    assert capfd.readouterr().out == "[a-1] hello\n\x1b[36m[a-1]\x1b[0m hello\n"


def test_json_stands_alone_on_stdout(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An object a line, the last one with the exit code; where the log files are is one, too."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    reports = Reports(Files().open_log_folder, json=True, on_closed=lambda: None)
    process = spec("a-1", output=OutputMode.LOG)
    reports(started(process))
    reports(wrote(process, b"hello"))
    reports.close(3)
    objects = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
    assert sorted(each["event"] for each in objects) == ["ended", "message", "output", "started"]
    assert objects[-1]["exit_code"] == 3
    (message,) = (each["text"] for each in objects if each["event"] == "message")
    folder = tmp_path / "callboard" / "log" / "latest"
    assert message == f"log files are in {folder.resolve()}"
    assert "[a-1] hello\n" in (folder / "launch.log").read_text()


def test_it_is_told_that_nobody_reads(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the launch can be stopped."""
    reading, writing = os.pipe()
    os.close(reading)
    unheard = threading.Event()
    with os.fdopen(writing, "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        reports = Reports(Files().open_log_folder, json=False, on_closed=unheard.set)
        reports(wrote(spec("a-1"), b"hello"))
        assert unheard.wait(DEADLINE_SEC)
        reports.close(0)
        assert reports.closed


@pytest.mark.parametrize("json", [False, True])
def test_what_is_printed_is_shown(capfd: pytest.CaptureFixture[str], *, json: bool) -> None:
    """In its place on stdout, unless that has JSON; never waited for."""
    reports = Reports(Files().open_log_folder, json=json, on_closed=lambda: None)
    reports(wrote(spec("a-1"), b"one"))
    reports.printed(Stream.STDOUT, b"printed\nno end")
    reports.printed(Stream.STDERR, b"bad\n")
    reports(wrote(spec("a-1"), b"two"))
    reports.close(0)
    shown = capfd.readouterr()
    if json:
        assert sorted(shown.err.splitlines()) == ["bad", "no end", "printed"]
        assert all(each.startswith("{") for each in shown.out.splitlines())
    else:
        assert shown == ("[a-1] one\nprinted\n[a-1] two\nno end\n", "bad\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
def test_a_full_disk_is_reported(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Once on stderr, and in the end how much is missing; nobody is taken to be gone."""
    with Path("/dev/full").open("w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        reports = Reports(Files().open_log_folder, json=False, on_closed=pytest.fail)
        for _ in range(3):
            reports(wrote(spec("a-1"), b"hello"))
        reports.close(0)
    assert capfd.readouterr().err.splitlines() == [
        "[ERROR] [launch]: stdout cannot be written: No space left on device",
        "[WARN] [launch]: 3 lines are missing on stdout",
    ]
    assert not reports.closed
