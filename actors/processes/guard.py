"""The guard: a small process that kills the processes of a supervisor that was killed itself.

A process cannot clean up after SIGKILL. So a supervisor that runs processes has a guard: a shell that reads
a pipe and knows from it which process groups live. When the pipe closes, the supervisor has ended, however
that came about, and the guard kills those groups.

A group must be known before its supervisor can die. That is why each child begins as a shell, too: it has the
pipe as its stdin, writes its own process id there, and only then becomes the child's program, without the
pipe. While it has not done so the pipe is open, and the guard waits for it.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.processes.process import Process
from proto.aio.forks import drop_in_children

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

SHELL: Final = "/bin/sh"

END_TIMEOUT_SEC: Final = 5.0
"""How long the guard may take to end."""

# A child writes its `+` itself, and its `-` is written when it is gone. So no `-` overtakes its `+`, but it
# may come without one: a child that is stopped at once has written nothing.
_GUARD: Final = """
trap "" INT TERM HUP
groups=
while read -r sign group; do
    case $sign in
    +) groups="$groups $group" ;;
    -)
        others=
        for each in $groups; do [ "$each" = "$group" ] || others="$others $each"; done
        groups=$others
        ;;
    esac
done
for group in $groups; do kill -s KILL -- "-$group"; done
"""

_STARTER: Final = 'echo "+ $$" >&0 || exit 125; exec "$@" </dev/null'


class Guard:
    """A supervisor's guard. It starts with the first process, and again if somebody has killed it.

    Where there are no process groups (Windows) there is no guard: processes are started as they are.
    """

    def __init__(self) -> None:
        self._process: Process | None = None
        self._pipe: int | None = None
        self._groups: set[int] = set()
        drop_in_children(self)

    def start(
        self,
        command: Sequence[str],
        *,
        cwd: str | Path | None,
        env: Mapping[str, str] | None,
        output: int | None = None,
        errors: int | None = None,
    ) -> Process:
        """Start a process under guard. Call `forget` when it has ended.

        Its stdin is empty; its stdout and stderr are `output`, or this process's; its stderr is `errors` if
        that is given. A command that cannot be run ends with 127, or 126 if it is there, and a line on
        stderr.

        Raises:
            OSError: The system cannot start a process now, or there is no such `cwd`.
        """
        if not hasattr(os, "killpg"):
            return Process(command, stdin=subprocess.DEVNULL, output=output, errors=errors, cwd=cwd, env=env)
        process = Process(
            (SHELL, "-c", _STARTER, "callboard", *command),
            stdin=self._ready(),
            output=output,
            errors=errors,
            cwd=cwd,
            env=env,
        )
        self._groups.add(process.pid)
        return process

    def forget(self, pid: int) -> None:
        """Stop guarding a process that has ended; its id may be reused."""
        self._groups.discard(pid)
        self._write(f"- {pid}\n")

    async def close(self) -> None:
        """End the guard. It kills the processes that have not been forgotten."""
        self._close_pipe()
        process, self._process = self._process, None
        if process is None:
            return
        try:
            async with asyncio.timeout(END_TIMEOUT_SEC):
                await process.wait()
        except TimeoutError:  # it is frozen (SIGSTOP)
            process.signal(signal.SIGKILL)
            await process.wait()

    def descriptors(self) -> tuple[int, ...]:
        """DescriptorOwner: the pipe. The guard would not notice the end if a forked child kept it open."""
        return () if self._pipe is None else (self._pipe,)

    def _close_pipe(self) -> None:
        pipe, self._pipe = self._pipe, None
        if pipe is not None:
            os.close(pipe)

    def _ready(self) -> int:
        """Return the pipe to a guard that lives."""
        if self._pipe is None or self._process is None or self._process.ended:
            self._begin()
        assert self._pipe is not None
        return self._pipe

    def _begin(self) -> None:
        self._close_pipe()
        if self._process is not None:
            self._process.reap()
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        self._pipe = writing
        try:
            # A group of its own, so that a signal for its supervisor's group does not meet it.
            self._process = Process((SHELL, "-c", _GUARD), stdin=reading, output=subprocess.DEVNULL)
        finally:
            os.close(reading)
        for pid in self._groups:
            self._write(f"+ {pid}\n")

    def _write(self, line: str) -> None:
        if self._pipe is None:
            return
        # A guard that was killed is replaced at the next start; one that is frozen is of no use either way.
        with suppress(BrokenPipeError, BlockingIOError):
            os.write(self._pipe, line.encode())
