"""Commands that are run for their output, and that nothing of them is left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from actors.launch.errors import LaunchError
from actors.launch.resources import command_output as module
from actors.launch.resources.command_output import MAX_OUTPUT_BYTES, command_output

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

LASTING = 'exec 4>"$0"; sleep 1000 >/dev/null 2>&1 & '
"""Begins with a process that holds a pipe open, and nothing else."""


def sh(script: str, *arguments: str) -> str:
    """Run a shell script."""
    return command_output(("/bin/sh", "-c", script, *arguments), {"PATH": os.defpath, "GREETING": "hé"})


@contextmanager
def outlived(path: Path) -> Generator[str]:
    """Give the path of a pipe; in the end wait until nobody has it any more."""
    os.mkfifo(path)
    reading = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        yield str(path)
        os.set_blocking(reading, True)
        assert os.read(reading, 1) == b""
    finally:
        os.close(reading)


def test_the_output_is_what_is_written() -> None:
    """With the environment that is given, nothing to read, and as many lines as there are."""
    assert sh('echo "$GREETING"; cat; echo oops >&2; printf "%s" "$1"', "sh", "a  b") == "hé\na  b"


@pytest.mark.parametrize(
    ("script", "error"),
    [
        ("echo >&2; echo no such robot >&2; echo more >&2; exit 3", "exit code 3: no such robot"),
        ("exit 1", "Command 'sh' has failed with exit code 1"),
        ("kill -9 $$", "exit code -9"),
        (r"printf '\377'", "Command 'sh' has not written UTF-8"),
        (r"printf '\033[1m\n' >&2; exit 1", r"exit code 1: \x1b[1m"),
    ],
)
def test_what_gives_no_text_is_an_error(script: str, error: str) -> None:
    """In one line that is harmless, with the first one that it complains with."""
    with pytest.raises(LaunchError) as caught:
        sh(script)
    assert str(caught.value).endswith(error)


@pytest.mark.parametrize(
    ("command", "error"),
    [
        (("/no/such/program",), "Command 'program' has failed with exit code 127: "),
        (("/bin/echo", "a\0b"), "Command 'echo' cannot be run: "),
    ],
)
def test_what_cannot_be_run_is_an_error(command: tuple[str, ...], error: str) -> None:
    """Whoever notices it."""
    with pytest.raises(LaunchError, match=error):
        command_output(command, {})


def test_output_has_a_limit(tmp_path: Path) -> None:
    """A command that writes without end is ended; stderr may be long."""
    assert (
        sh(f"head -c {MAX_OUTPUT_BYTES} /dev/zero; head -c 300000 /dev/zero >&2") == "\0" * MAX_OUTPUT_BYTES
    )
    with (
        outlived(tmp_path / "pipe") as pipe,
        pytest.raises(LaunchError, match=f"has written more than {MAX_OUTPUT_BYTES} bytes"),
    ):
        sh(f"{LASTING} cat /dev/zero", pipe)


@pytest.mark.parametrize("script", ["sleep 1000", "exec >/dev/null 2>&1; sleep 1000", "cat /dev/zero >&2"])
def test_time_has_a_limit(script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether it still may write, has closed its output, or does write."""
    monkeypatch.setattr(module, "COMMAND_TIMEOUT_SEC", 0.1)
    with (
        outlived(tmp_path / "pipe") as pipe,
        pytest.raises(LaunchError, match=r"Command 'sh' has not ended within 0\.1 s"),
    ):
        sh(f"{LASTING} {script}", pipe)


def test_nothing_is_left_of_a_command_that_has_ended(tmp_path: Path) -> None:
    """Not what it has started in the background either."""
    with outlived(tmp_path / "pipe") as pipe:
        assert sh(f"{LASTING} echo done", pipe) == "done\n"


@pytest.mark.parametrize("rest_timeout_sec", [0.0, 0.05])
def test_its_end_does_not_wait_for_who_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rest_timeout_sec: float
) -> None:
    """Nor for all that they write: its output is what has come by its end, however late that is seen."""
    monkeypatch.setattr(module, "COMMAND_TIMEOUT_SEC", 1000)
    monkeypatch.setattr(module, "REST_TIMEOUT_SEC", rest_timeout_sec)
    for rest in ("sleep 1000", "while :; do echo more >&2; done"):
        with outlived(tmp_path / rest[:5]) as pipe:
            assert sh(f"{LASTING} ({rest}) & echo done", pipe) == "done\n"


def test_ctrl_c_ends_it(tmp_path: Path) -> None:
    """At once, and nothing is left of it: what the signal's handler raises comes through."""
    # More than a pipe holds: once all of it is written, the caller is reading, and Popen() has returned.
    output = "head -c 500000 /dev/zero"

    def interrupt() -> None:
        path.read_text()
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    os.mkfifo(path := tmp_path / "begun")
    thread = threading.Thread(target=interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        thread.start()
        with outlived(tmp_path / "pipe") as pipe, pytest.raises(KeyboardInterrupt):
            sh(f"{LASTING} {output}; echo > '{path}'; sleep 1000", pipe)
    finally:
        signal.signal(signal.SIGINT, before)
        thread.join()


@pytest.mark.processes
def test_nothing_is_left_when_the_launch_is_killed(tmp_path: Path) -> None:
    """Though it cannot clean up any more."""
    os.mkfifo(path := tmp_path / "pipe")
    code = (
        "import sys; from actors.launch.resources.command_output import command_output;"
        "command_output(('/bin/sh', '-c', sys.argv[1], sys.argv[2]), {})"
    )
    script = 'exec 4>"$0"; echo here >&4; sleep 1000'
    with subprocess.Popen([sys.executable, "-c", code, script, str(path)]) as launch, path.open() as pipe:
        assert pipe.readline() == "here\n"
        launch.send_signal(signal.SIGKILL)
        assert pipe.read() == ""
