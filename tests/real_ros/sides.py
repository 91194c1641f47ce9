"""A side: a long-lived process that answers questions, of real ROS 2 or of callboard's ROS face."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from tests.fork_server.client import add_interpreter, forked
from tests.real_ros import REAL_PYTHON, ROOT

if TYPE_CHECKING:
    import signal
    from collections.abc import Mapping

ANSWER_TIMEOUT_SEC: Final = 60.0
STOP_TIMEOUT_SEC: Final = 10.0
MAX_DOMAIN: Final = 101
"""Domains above it may use ports that the system gives to other programs."""
MAX_STDERR_BYTES: Final = 4000
FOREIGN: Final = ("ROS_", "RMW_", "RCUTILS_", "FASTRTPS_", "FASTDDS_", "AMENT_", "COLCON_", "PYTHONPATH")
"""What variables of the developer's own ROS 2 begin with. The sides do not get them."""

PROGRAMS_MODULE: Final = ("-m", "tests.real_ros.programs")
REAL_COMMAND: Final = (str(REAL_PYTHON), *PROGRAMS_MODULE)
FACE_COMMAND: Final = (sys.executable, "-m", "actors.ros", "--no-broker", *PROGRAMS_MODULE)


# Without rclpy. Its library for tracing starts threads, which a fork does not copy, and cancels them when the
# process exits: threads of the child that have got their ids, such as uvloop's, which then never end.
add_interpreter(str(REAL_PYTHON), ("actors.cli.main", "actors.interfaces", "actors.bridges.ros2.*", "numpy"))


@dataclass(frozen=True)
class Answer:
    """What a function on a side has returned or raised.

    Attributes:
        returned: What it has returned, as JSON carries it.
        raised: The names of the exception's class and its bases, its own first; empty if there was none.
        text: The exception's text.
        traceback: Its traceback.
    """

    returned: Any = None
    raised: tuple[str, ...] = ()
    text: str = ""
    traceback: str = ""

    @property
    def outcome(self) -> object:
        """What two sides are compared by. The texts of errors are each side's own."""
        return {"raises": self.raised} if self.raised else {"returned": self.returned}


class SideError(Exception):
    """A side has not answered: its process has ended, or its time was over."""


class Side:
    """A process that starts with the first question.

    Args:
        command: Its command.
        environ: Variables in addition to those of this process.
    """

    def __init__(self, command: tuple[str, ...], environ: Mapping[str, str]) -> None:
        self._command = command
        own = {name: value for name, value in os.environ.items() if not name.startswith(FOREIGN)}
        self._environ = {**own, **environ}
        self._process: subprocess.Popen[bytes] | None = None
        self._stderr: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - `close` does; a pipe would be full
        self._received = b""
        self._read = 0

    def ask(self, function: str, *args: object) -> Answer:
        """Call a function of a module in `programs/`, such as "qos.depths".

        Args:
            function: Its module and name.
            *args: Its arguments, as JSON has them.

        Raises:
            SideError: The process has ended or not answered in time. The next question starts another one.
        """
        process = self._process or self._start()
        assert process.stdin is not None
        try:
            process.stdin.write(json.dumps([function, args]).encode() + b"\n")
            process.stdin.flush()
            line = self._read_line(process)
        except (OSError, SideError) as error:
            self._kill(process)
            self._read = 0
            raise SideError(
                f"{function}{args} on {self._command[0]}: {error}. Its stderr:\n{self.output()}"
            ) from None
        return Answer(**json.loads(line))

    def call(self, function: str, *args: object) -> Any:
        """Return what a function returns that has no reason to raise.

        Raises:
            SideError: It has raised, with its traceback; or as for `ask`.
        """
        answer = self.ask(function, *args)
        if answer.raised:
            raise SideError(f"{function}{args} raised:\n{answer.traceback}")
        return answer.returned

    def output(self) -> str:
        """Return the end of what it has written to stderr since its start, or since the last call."""
        # Not by the file's own position, which is the process's as well.
        size = os.fstat(self._stderr.fileno()).st_size
        begin = max(self._read, size - MAX_STDERR_BYTES)
        self._read = size
        return os.pread(self._stderr.fileno(), size - begin, begin).decode(errors="replace")

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal to the process, if it has been started."""
        if self._process is not None:
            self._process.send_signal(number)

    def close(self) -> None:
        """End the process: it stops when its input ends."""
        if self._process is not None:
            assert self._process.stdin is not None
            self._process.stdin.close()
            try:
                self._process.wait(STOP_TIMEOUT_SEC)
            except subprocess.TimeoutExpired:
                pass
            finally:
                self._kill(self._process)
        self._stderr.close()

    def _start(self) -> subprocess.Popen[bytes]:
        if not Path(self._command[0]).exists():
            raise SideError(f"{self._command[0]} does not exist: run `make test`, which builds it")
        self._received = b""
        self._read = 0
        self._stderr.seek(0)
        self._stderr.truncate(0)
        self._process = subprocess.Popen(
            self._command,
            executable=forked(self._command[0]),
            cwd=ROOT,
            env=self._environ,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
        )
        return self._process

    def _read_line(self, process: subprocess.Popen[bytes]) -> bytes:
        assert process.stdout is not None
        deadline = time.monotonic() + ANSWER_TIMEOUT_SEC
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._received:
                if not selector.select(max(0.0, deadline - time.monotonic())):
                    raise SideError(f"no answer within {ANSWER_TIMEOUT_SEC:g} s")
                received = os.read(process.stdout.fileno(), 65536)
                if not received:
                    raise SideError(f"its process ended with {process.wait(STOP_TIMEOUT_SEC)}")
                self._received += received
        line, _, self._received = self._received.partition(b"\n")
        return line

    def _kill(self, process: subprocess.Popen[bytes]) -> None:
        process.kill()
        process.wait()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.close()
        process.stdout.close()
        self._process = None


class Domain:
    """A ROS domain that no other tests on this machine use, not even those of another checkout.

    Args:
        first: The domain to try first.

    Attributes:
        number: The domain.
    """

    def __init__(self, first: int) -> None:
        import fcntl  # noqa: PLC0415 - Windows collects these tests, and has no such module

        for number in (*range(first, MAX_DOMAIN + 1), *range(first)):
            path = Path(tempfile.gettempdir()) / f"callboard-ros-domain-{number}-{os.getuid()}"
            self._lock = path.open("wb")
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._lock.close()
                continue
            self.number = number
            return
        raise SideError("all ROS domains are in use by other tests")

    def close(self) -> None:
        """Let others use it."""
        self._lock.close()
