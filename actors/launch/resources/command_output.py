"""The output of a command that is run to its end, for texts of a launch file.

No part of the command is left behind, whether it takes too long, says too much, or the launch is killed
meanwhile: there is a watcher in its process group, which reads a pipe that nobody writes to. When the pipe
closes, here or because this process has ended, the watcher kills the group and itself with it.
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
from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping, Sequence

COMMAND_TIMEOUT_SEC: Final = 30.0
"""People wait for it, and nothing has been started yet."""
REST_TIMEOUT_SEC: Final = 1.0
"""How long its output is read after its end. Only what it has left in the background can hold that open."""
POLL_INTERVAL_SEC: Final = 0.05
"""How soon its end is seen, if its output does not end with it."""
MAX_OUTPUT_BYTES: Final = 1 << 20
"""More than this is no text for a launch file."""
_KEPT_ERROR_BYTES: Final = 1 << 12
"""Of stderr, of which the first line is shown."""
_READ_BYTES: Final = 1 << 16

# Only the watcher has the pipe, and it has nothing of the command's output, which would not end otherwise.
_STARTER: Final = (
    'exec 3<&0; { read -r _ <&3; kill -s KILL -- "-$$"; } >/dev/null 2>&1 & exec "$@" </dev/null 3<&-'
)


def command_output(command: Sequence[str], environment: Mapping[str, str]) -> str:
    """Run a command, without a shell and with an empty stdin, and return exactly what it writes to stdout.

    This blocks, for `COMMAND_TIMEOUT_SEC` at most, or until the call is `abandoned`. What the command has
    left in the background ends with it.

    Args:
        command: The program, with its path, and its arguments.
        environment: All that it gets.

    Raises:
        LaunchError: It cannot be run, fails, takes too long, or writes what is no text or too long.
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
        raise LaunchError(f"Command '{name}' has written what is no UTF-8 text") from None


@contextmanager
def _started(
    command: Sequence[str], environment: Mapping[str, str], name: str
) -> Generator[subprocess.Popen[bytes]]:
    """Start a command under watch; in the end nothing of it runs."""
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
                process.kill()  # in case somebody has killed the watcher


def _read(process: subprocess.Popen[bytes], name: str, deadline: float) -> tuple[bytes, bytes]:
    """Return all of its stdout, and the beginning of its stderr."""
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
    """Return its exit code, when it has ended."""
    while True:
        with suppress(subprocess.TimeoutExpired):
            return process.wait(POLL_INTERVAL_SEC)
        if _checked(name) >= deadline:
            raise _too_slow(name)


def _checked(name: str) -> float:
    """Return the time, if the output is still wanted."""
    if abandoned():
        raise LaunchError(f"Command '{name}' was interrupted")
    return time.monotonic()


def _too_slow(name: str) -> LaunchError:
    return LaunchError(f"Command '{name}' has not ended within {COMMAND_TIMEOUT_SEC:g} s")
