"""Starts Python programs in children of a process that has imported callboard already.

    await asyncio.create_subprocess_exec(sys.executable, "-m", "broker", executable=FORKED)
    subprocess.run([sys.executable, "-c", source], executable=FORKED, check=True)

Such a program behaves as after a real start (see `tests.fork_server.server`), but modules are loaded already.
So tests of starting, of imports and of what is seen from outside (command line, memory) do not use it.

What the server cannot imitate is started as usual: options of the interpreter other than -u, another value of
a variable that is read early, ignored or blocked signals, another user, a `preexec_fn`. The same holds for
everything where there are no subreapers, which only Linux has.

`add_interpreter` adds another interpreter, such as that of real ROS 2. It has a server of its own.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from tests.fork_server.request import ANSWER, Request, read_early, receive_exactly, send

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROOT: Final = Path(__file__).parents[2]

MODULES: Final[list[str]] = [
    *("uvloop", "broker", "broker.daemon.command", "actors", "actors.cli.main", "actors.launch"),
    *("actors.cli.commands.*", "actors.interfaces.*"),
]
"""What the programs of tests import, `.*` with all modules of a package. Each makes forks slower that do
without it."""

CUSTOM: Final = ("sitecustomize.py", "usercustomize.py", "proto", "broker", "actors")
"""Modules of folders in PYTHONPATH that Python would import at its start, or instead of the server's."""

WATCHED_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGCHLD)

LIMITS: Final = {getattr(resource, name) for name in dir(resource) if name.startswith("RLIMIT_")}

PR_SET_CHILD_SUBREAPER: Final = 36
"""From linux/prctl.h."""

ARGUMENTS: Final = (
    *("args", "executables", "close_fds", "kept", "folder", "variables"),
    *("stdin", "_", "_", "stdout", "_", "stderr", "_", "errors"),
    *("restore_signals", "new_session", "process_group", "gid", "groups", "uid", "umask", "preexec_fn"),
)
"""Names for the arguments of `_posixsubprocess.fork_exec`, in order."""


class ForkServer:
    """A fork server of this process: started at its first use, and again if somebody has killed it.

    Args:
        python: The interpreter.
        modules: What it imports.

    Attributes:
        python: The interpreter.
    """

    def __init__(self, python: str, modules: Sequence[str]) -> None:
        self.python = python
        self._modules = modules
        self._lock = threading.Lock()  # one request at a time
        self._channel: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._read_early: dict[bytes, bytes] = {}

    def fork(self, request: Request, descriptors: Sequence[int]) -> int | None:
        """Start a program in a child of this process.

        Returns:
            Its process id; None if an interpreter in this environment would differ from the server.
        """
        with self._lock:
            channel = self._start()
            if read_early(request.environment) != self._read_early:
                return None
            with _subreaper():
                send(channel, request, descriptors)
                (pid,) = ANSWER.unpack(receive_exactly(channel, ANSWER.size))
        assert pid, f"The fork server could not prepare {request.command}"
        return int(pid)

    def close(self) -> None:
        """End the server."""
        if self._channel is not None and self._process is not None:
            self._channel.close()
            self._process.wait()

    def _start(self) -> socket.socket:
        if self._channel is not None and self._process is not None and self._process.poll() is None:
            return self._channel
        self._channel, theirs = socket.socketpair()
        self._read_early = read_early(os.environb)
        command = (self.python, "-m", "tests.fork_server.server", str(theirs.fileno()), *self._modules)
        with theirs:
            self._process = subprocess.Popen(
                command, cwd=ROOT, stdin=subprocess.DEVNULL, pass_fds=(theirs.fileno(),)
            )
        return self._channel


@contextmanager
def _subreaper() -> Iterator[None]:
    """Adopt the processes whose parents, descendants of this process, end meanwhile."""
    prctl = ctypes.CDLL(None, use_errno=True).prctl
    assert prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0, os.strerror(ctypes.get_errno())
    try:
        yield
    finally:
        prctl(PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)


_servers: Final[dict[bytes, ForkServer]] = {}


def add_interpreter(python: str, modules: Sequence[str]) -> str:
    """Let programs of an interpreter be forked.

    Args:
        python: Its path, the first word of their commands.
        modules: What its server imports, as `MODULES`.

    Returns:
        The `executable` of a program to fork. It is a path of the interpreter, so that it works in any case.
    """
    executable = f"{Path(python).parent}/./{Path(python).name}"
    _servers[os.fsencode(executable)] = ForkServer(python, modules)
    return executable


def forked(program: str) -> str | None:
    """Return the `executable` for a program if it is an interpreter whose programs can be forked."""
    return next((os.fsdecode(path) for path, each in _servers.items() if each.python == program), None)


FORKED: Final = add_interpreter(sys.executable, MODULES)
"""The `executable` of a program of this interpreter."""

_start_as_usual: Any = getattr(subprocess, "_fork_exec", None)


def _fork_exec(*arguments: Any) -> int:
    """Start a process for `subprocess.Popen`, and fork it if it asks for that."""
    call = SimpleNamespace(**dict(zip(ARGUMENTS, arguments, strict=False)))
    server = _servers.get(call.executables[0]) if len(call.executables) == 1 else None
    pid = None if server is None else _fork(call, server)
    return int(_start_as_usual(*arguments)) if pid is None else pid


def _fork(call: SimpleNamespace, server: ForkServer) -> int | None:
    """Return the id of a forked process; None if the call wants what the server cannot imitate."""
    folder = Path(os.fsdecode(call.folder or "."))
    program = _parse([os.fsdecode(word) for word in call.args], folder, server.python)
    if program is None or not _is_ordinary(call) or not folder.is_dir():
        return None
    streams = (call.stdin, call.stdout, call.stderr)
    others = [number for number in call.kept if number != call.errors]
    request = Request(
        *program,
        folder=str(folder.absolute()),
        environment=_environment(call.variables),
        new_session=call.new_session,
        process_group=call.process_group,
        umask=call.umask,
        limits={number: resource.getrlimit(number) for number in LIMITS},
        numbers=[0, 1, 2, *others],
    )
    given = [own if stream < 0 else stream for own, stream in enumerate(streams)]
    return server.fork(request, [*given, *others])


def _is_ordinary(call: SimpleNamespace) -> bool:
    return (
        call.close_fds
        and call.restore_signals
        and (call.gid, call.groups, call.uid, call.preexec_fn) == (None, None, None, None)
        and not signal.pthread_sigmask(signal.SIG_BLOCK, ())
        and not _is_customized(_environment(call.variables).get(b"PYTHONPATH", b""))
        and signal.SIG_IGN not in {signal.getsignal(number) for number in WATCHED_SIGNALS}
    )


def _is_customized(search_path: bytes) -> bool:
    folders = {Path(each).absolute() for each in os.fsdecode(search_path).split(os.pathsep) if each} - {ROOT}
    return any((folder / name).exists() for folder in folders for name in CUSTOM)


def _environment(variables: Sequence[bytes] | None) -> dict[bytes, bytes]:
    given = _inherited() if variables is None else variables
    return {key: value for key, _, value in (each.partition(b"=") for each in given)}


def _inherited() -> Iterator[bytes]:
    """Yield what a child inherits; os.environ lacks what C libraries set, as readline does."""
    environ = ctypes.POINTER(ctypes.c_char_p).in_dll(ctypes.CDLL(None), "environ")
    for number in count():
        variable = environ[number]
        if variable is None:
            return
        yield variable


def _parse(
    command: Sequence[str], folder: Path, python: str
) -> tuple[list[str], bool, str, str, list[str]] | None:
    """Return the fields of a request; None if the command is not a program after, at most, -u."""
    rest = list(command[1:])
    unbuffered = rest[:1] == ["-u"]
    del rest[:unbuffered]
    kind = rest.pop(0) if rest and rest[0] in {"-c", "-m"} else ""
    if command[0] != python or not rest:
        return None
    program = rest.pop(0)
    if (kind, program) == ("-m", "pytest"):  # it rewrites modules when they are imported
        return None
    if not kind and not _is_source(folder / program):
        return None
    return list(command), unbuffered, kind, program, rest


def _is_source(path: Path) -> bool:
    """Return whether a file is a program: Python runs folders and archives, too."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return path.suffix == ".py" or file.read(2) == b"#!"


def _close_servers() -> None:
    for server in _servers.values():
        server.close()


if sys.platform == "linux" and _start_as_usual is not None:
    setattr(subprocess, "_fork_exec", _fork_exec)  # noqa: B010 - the name is private
    atexit.register(_close_servers)
