"""A process in its own process group, which is killed when the process ends.

`loop.create_subprocess_exec` is not suitable: uvloop's leaks the descriptor of stdin into the child under a
second number, and every loop reaps a child before its group can be killed. Here the group is killed while the
child is a zombie, so that its id cannot belong to another process yet.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


class Process:
    """A running process. Starting it blocks the loop for some milliseconds.

    A pidfd reports its end where the system has one (Linux), otherwise a thread does.

    Args:
        command: The program and its arguments.
        stdin: A file descriptor, or `subprocess.DEVNULL`.
        output: A file descriptor for stdout and stderr, or `subprocess.DEVNULL`; None: this process's.
        errors: A file descriptor for stderr; None: `output`.
        cwd: The working directory; None: this process's.
        env: The environment; None: this process's.

    Raises:
        OSError: The system cannot start it now, or there is no such program or `cwd`.

    Attributes:
        pid: The id of the process and of its group.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        stdin: int,
        output: int | None = None,
        errors: int | None = None,
        cwd: str | Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._process = subprocess.Popen(  # noqa: S603 - running given commands is its purpose
            command,
            stdin=stdin,
            stdout=output,
            stderr=output if errors is None else errors,
            cwd=cwd,
            env=env,
            start_new_session=True,
        )
        self.pid = self._process.pid
        self._pidfd: int | None = None
        if not self._watch_descriptor():
            thread = threading.Thread(target=self._watch, name=f"end of {self.pid}", daemon=True)
            try:
                thread.start()
            except RuntimeError:
                self.reap()
                raise

    @property
    def ended(self) -> bool:
        """Whether it has ended; it may not have been reaped yet."""
        return self._ended.is_set()

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the process and its group. Once it has been reaped this does nothing."""
        if self._process.returncode is not None:
            return
        if not hasattr(os, "killpg"):  # Windows has no groups and no signals
            self._process.terminate()
            return
        # PermissionError: macOS raises it for a group of zombies.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, number)

    async def wait(self) -> int:
        """Wait for the end, kill the rest of the group, and return the exit code (negative: a signal)."""
        await self._ended.wait()
        return self.reap()

    def reap(self) -> int:
        """Kill the process, if it has not ended, and the rest of its group; return the exit code."""
        self.signal(signal.SIGKILL)
        code = self._process.wait()
        self._end()
        return code

    def _watch_descriptor(self) -> bool:
        """Watch a pidfd for the end; return False if the system has none."""
        if not hasattr(os, "pidfd_open"):
            return False
        try:
            self._pidfd = os.pidfd_open(self.pid)
        except ProcessLookupError:  # SIGCHLD is ignored, and it has ended
            self._ended.set()
            return True
        except OSError:  # an old kernel, or a container that forbids it
            return False
        self._loop.add_reader(self._pidfd, self._end)
        return True

    def _end(self) -> None:
        self._ended.set()
        if self._pidfd is not None:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.remove_reader(self._pidfd)
            os.close(self._pidfd)
            self._pidfd = None

    def _watch(self) -> None:
        """In the thread: wait for the end, and leave the zombie where that is possible."""
        if hasattr(os, "waitid"):
            with suppress(ChildProcessError):  # SIGCHLD is ignored, so that nobody has to reap
                os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)
        else:
            self._process.wait()
        with suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._end)
