"""Runs a command to its end and returns its output, for the substitution `Command`.

No process of the command outlives the call, whether it takes too long, writes too much, or the launch is
killed meanwhile: a watcher in its process group reads a pipe to which nothing is written. When the pipe
closes, here or because this process has ended, the watcher kills the group, and itself with it.
"""

from __future__ import annotations

import os
import selectors
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from actors.launch.engine.worker import abandoned
from actors.launch.errors import LaunchError
from actors.processes.guard import SHELL
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping, Sequence

COMMAND_TIMEOUT_SEC: Final = 30.0
"""Limit of a command. Nothing has been started yet, and users wait."""
REST_TIMEOUT_SEC: Final = 1.0
"""How long the output is read after the end of the command. Only background processes keep it open."""
POLL_INTERVAL_SEC: Final = 0.05
"""How soon the end of the command is noticed while background processes keep its output open."""
MAX_OUTPUT_BYTES: Final = 1 << 20
"""Limit of the output."""
_KEPT_ERROR_BYTES: Final = 1 << 12
"""Beginning of stderr that is kept; its first line is shown."""
_READ_BYTES: Final = 1 << 16

# Only the watcher has the pipe, and it has nothing of the command's output, which would not end otherwise.
_STARTER: Final = (
    'exec 3<&0; { read -r _ <&3; kill -s KILL -- "-$$"; } >/dev/null 2>&1 & exec "$@" </dev/null 3<&-'
)


def command_output(command: Sequence[str], environment: Mapping[str, str]) -> str:
    """Run a command, without a shell and with an empty stdin, and return exactly what it writes to stdout.

    This blocks for at most `COMMAND_TIMEOUT_SEC`, or until the call is `abandoned`. Processes that the
    command has left in the background are killed.

    Args:
        command: The program, with its path, and its arguments.
        environment: Its whole environment.

    Raises:
        LaunchError: It cannot be run, fails, takes too long, or its output is too long or not UTF-8.
    """
    name = escape(PurePath(command[0]).name)
    deadline = time.monotonic() + COMMAND_TIMEOUT_SEC
    with _started(command, environment, name) as process:
        output, errors = _read(process, name, deadline)
        code = _wait(process, name, deadline)
    if code != 0:
        lines = errors.decode(errors="replace").strip().splitlines()
        why = f": {escape(lines[0])}" if lines else ""
        raise LaunchError(f"Command '{name}' has failed with exit code {code}{why}")
    try:
        return output.decode()
    except UnicodeDecodeError:
        raise LaunchError(f"Command '{name}' has not written UTF-8") from None


@contextmanager
def _started(
    command: Sequence[str], environment: Mapping[str, str], name: str
) -> Generator[subprocess.Popen[bytes]]:
    """Start a command with its watcher; on leaving, none of its processes runs any more."""
    reading, writing = os.pipe()
    with os.fdopen(writing, "wb", 0) as alive:
        with os.fdopen(reading, "rb", 0) as watched:
            try:
                process = subprocess.Popen(  # noqa: S603 - running given commands is its purpose
                    (SHELL, "-c", _STARTER, "callboard", *command),
                    stdin=watched,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    env=environment,
                    start_new_session=True,
                )
            except (OSError, ValueError) as error:
                raise LaunchError(f"Command '{name}' cannot be run: {error}") from None
        with process:
            try:
                yield process
            finally:
                alive.close()
                process.kill()  # the watcher may have been killed


def _read(process: subprocess.Popen[bytes], name: str, deadline: float) -> tuple[bytes, bytes]:
    """Return the stdout of a command, and the beginning of its stderr."""
    assert process.stdout is not None
    assert process.stderr is not None
    output, errors = bytearray(), bytearray()
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ, output)
        selector.register(process.stderr, selectors.EVENT_READ, errors)
        ended = False
        while selector.get_map():
            ready = selector.select(POLL_INTERVAL_SEC)
            now = _checked(name)
            for key, _ in ready:
                data = os.read(key.fd, _READ_BYTES)
                if not data:
                    selector.unregister(key.fileobj)
                key.data.extend(data)
            del errors[_KEPT_ERROR_BYTES:]
            if len(output) > MAX_OUTPUT_BYTES:
                raise LaunchError(f"Command '{name}' has written more than {MAX_OUTPUT_BYTES} bytes")
            if not ended and process.poll() is not None:
                # What it has written fits one more read of each pipe, which follows even if that is late.
                ended, deadline = True, now + REST_TIMEOUT_SEC
            elif now >= deadline:
                if ended:
                    break
                raise _too_slow(name)
    return bytes(output), bytes(errors)


def _wait(process: subprocess.Popen[bytes], name: str, deadline: float) -> int:
    """Wait for the end of a command and return its exit code."""
    while True:
        with suppress(subprocess.TimeoutExpired):
            return process.wait(POLL_INTERVAL_SEC)
        if _checked(name) >= deadline:
            raise _too_slow(name)


def _checked(name: str) -> float:
    """Return the current time, unless nobody waits for the output any more."""
    if abandoned():
        raise LaunchError(f"Command '{name}' was interrupted")
    return time.monotonic()


def _too_slow(name: str) -> LaunchError:
    return LaunchError(f"Command '{name}' has not ended within {COMMAND_TIMEOUT_SEC:g} s")
