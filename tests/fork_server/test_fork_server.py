"""Programs from the fork server cannot be told from programs that were started."""

from __future__ import annotations

import asyncio
import ctypes
import os
import re
import resource
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from tests.fork_server.client import FORKED, ROOT

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [
    pytest.mark.processes,
    pytest.mark.skipif(sys.platform != "linux", reason="needs subreapers"),
]

KINDS = ("-c", "-m", "script", "-u -c", "-u script")

SURROUNDINGS = """
import os, resource, signal, sys, threading
print(sys.argv, sys.orig_argv, sys.executable, sys.path, sys.warnoptions)
print(sorted(os.environ.items()), os.getcwd(), os.getppid(), os.umask(0))
print(os.getpgid(0) == os.getpid(), os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpgid(os.getppid()))
print(sorted(int(name) for name in os.listdir("/proc/self/fd")))
print([(number, signal.getsignal(number)) for number in signal.valid_signals()])
print([resource.getrlimit(number) for number in (resource.RLIMIT_NOFILE, resource.RLIMIT_CORE)])
print(threading.enumerate() == [threading.main_thread()], signal.pthread_sigmask(signal.SIG_BLOCK, ()))
for stream in (sys.stdin, sys.stdout, sys.stderr):
    print(stream, stream.fileno(), stream.errors, stream.line_buffering, stream.write_through)
    print(type(stream.buffer).__name__, stream.isatty(), stream.buffer.closed)
print(sys.__stdin__ is sys.stdin, sys.__stdout__ is sys.stdout, sys.__stderr__ is sys.stderr)
print(sorted(vars()), __name__, __package__, __spec__ and __spec__.name)
print(vars(sys.modules["__main__"]) is globals(), type(__loader__), globals().get("__file__"))
print(repr(sys.stdin.read()))
"""

ENDS = {
    "nothing": "",
    "exit code": "import sys; sys.exit(3)",
    "exit text": "import sys; sys.exit('a text')",
    "error": "def fail():\n    1 / 0\ntry:\n    fail()\nexcept ArithmeticError:\n    raise ValueError(1)",
    "group": "raise ExceptionGroup('group', [ValueError('value')])",
    "syntax": "(",
    "interrupt": "raise KeyboardInterrupt",
    "signal": "import os, signal; os.kill(os.getpid(), signal.SIGINT); signal.pause()",
    "kill": "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
    "at once": "import os; print('lost', end=''); os._exit(4)",
    "hook": "import sys; sys.excepthook = lambda *args: print('hook', *args[:2]); 1 / 0",
    "thread": "import threading\ngo = threading.Event()\n"
    "threading.Thread(target=lambda: go.wait() and print('thread')).start(); print('main'); go.set()",
    "failed thread": "import threading\nthreading.Thread(target=lambda: 1 / 0, name='t').start()",
    "at exit": "import atexit; atexit.register(print, 'at exit'); print('end', end='')",
    "destructor": "class Made:\n    def __del__(self): print('destroyed')\nmade = Made()\nmade.itself = made",
    "never awaited": "async def main(): pass\nkept = main()",
    "a module is missing": "import no_such_module",
}


class Outcome(NamedTuple):
    """How a program ended, and what it wrote."""

    code: int
    output: list[str]
    errors: list[str]


def run(*command: str, executable: str | None = FORKED, **options: Any) -> Outcome:
    """Run a program."""
    streams = {"capture_output": True} if "stdout" not in options else {}
    done = subprocess.run(
        [sys.executable, *command], executable=executable, text=True, check=False, **(streams | options)
    )
    return Outcome(done.returncode, *((each or "").splitlines() for each in (done.stdout, done.stderr)))


def is_forked(**options: Any) -> bool:
    """Return whether a program finds callboard's modules loaded."""
    return run("-c", "import sys; print('actors.node.node' in sys.modules)", **options).output == ["True"]


def command(kind: str, source: str, folder: Path) -> list[str]:
    """Return what makes the interpreter run a source text in a folder."""
    (folder / "the_program.py").write_text(source, encoding="utf-8")
    *options, way = kind.split()
    named = {"-c": ("-c", source), "-m": ("-m", "the_program"), "script": ("the_program.py",)}
    return [*options, *named[way], "one", "-x"]


def test_programs_are_forked() -> None:
    """Otherwise the other tests here would compare nothing."""
    assert is_forked()
    assert not is_forked(executable=None)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"start_new_session": True, "env": {"A": "b=c", "PYTHONUNBUFFERED": "1"}},
        {"env": {"PYTHONPATH": f"/nowhere::relative:{ROOT}"}},
        {"process_group": 0, "umask": 0o27},
        {"stderr": subprocess.STDOUT, "stdout": subprocess.PIPE},
    ],
    ids=["plain", "session", "path", "group", "one stream"],
)
@pytest.mark.parametrize("kind", KINDS)
def test_surroundings(kind: str, options: dict[str, Any], tmp_path: Path) -> None:
    """Arguments, environment, streams, descriptors, signals, limits and the main module are the same."""
    words = command(kind, SURROUNDINGS, tmp_path)
    given = {"cwd": tmp_path, "input": "in\r\nput", **options}
    if "env" in options:  # added to what the server of this run has
        given["env"] = os.environ | options["env"]
    forked = run(*words, **given)
    assert forked == run(*words, executable=None, **given)
    assert forked.output[-1] == "'in\\r\\nput'"


@pytest.mark.parametrize("kind", ["-m", "script"])
@pytest.mark.parametrize("end", ENDS)
def test_ends(end: str, kind: str, tmp_path: Path) -> None:
    """Exit codes, signals, tracebacks and what is written at the end are the same."""
    words = command(kind, ENDS[end], tmp_path)
    forked, started = (run(*words, executable=each, cwd=tmp_path) for each in (FORKED, None))
    assert _without_addresses(forked) == _without_addresses(started)


def _without_addresses(outcome: Outcome) -> tuple[object, ...]:
    return tuple(re.sub(r"0x[0-9a-f]+", "0x", str(each)) for each in outcome)


def test_limits_and_descriptors_of_now_are_inherited() -> None:
    """Those of this process, not those at the start of the server."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    source = "import os; from resource import *; print(os.read({}, 9), getrlimit(RLIMIT_NOFILE))"
    reading, writing = os.pipe()
    assert is_forked()
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft - 1, hard))
    try:
        os.write(writing, b"passed")
        os.close(writing)
        assert run("-c", source.format(reading), pass_fds=[reading]).output == [
            f"b'passed' {(soft - 1, hard)}"
        ]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        os.close(reading)


def test_variables_of_c_libraries_are_inherited() -> None:
    """os.environ does not have them: readline sets COLUMNS where it is imported."""
    libc = ctypes.CDLL(None)
    libc.setenv(b"SET_IN_C", b"1", 1)
    try:
        assert run("-c", "import os; print(os.environ['SET_IN_C'])") == Outcome(0, ["1"], [])
    finally:
        libc.unsetenv(b"SET_IN_C")


def test_chance_is_not_shared() -> None:
    """Two programs draw different random numbers."""
    source = "import random, secrets, uuid; print(random.random(), secrets.token_hex(), uuid.uuid4())"
    one, other = (run("-c", source).output[0].split() for _ in range(2))
    assert len({*one, *other}) == 6


@pytest.mark.parametrize(
    "options",
    [
        {"env": {**os.environ, "PYTHONHASHSEED": "1"}},
        {"env": {**os.environ, "LC_ALL": "C"}},
        {"preexec_fn": os.getpid},
        {"close_fds": False},
        {"restore_signals": False},
    ],
    ids=["hash seed", "locale", "preexec_fn", "descriptors", "signals"],
)
def test_what_cannot_be_imitated_is_started(options: dict[str, Any]) -> None:
    """Programs with other settings of the interpreter, and calls that ask for more."""
    assert not is_forked(**options)


def test_a_customized_interpreter_is_started(tmp_path: Path) -> None:
    """It runs code before the program."""
    (tmp_path / "sitecustomize.py").touch()
    assert not is_forked(env={**os.environ, "PYTHONPATH": str(tmp_path)})


@pytest.mark.parametrize("word", ["-V", "-X", "-Werror", "no_such_file.py", "-"])
def test_other_commands_are_started(word: str) -> None:
    """The interpreter reads them itself."""
    assert run(word, stdin=subprocess.DEVNULL) == run(word, stdin=subprocess.DEVNULL, executable=None)


def test_ignored_and_blocked_signals_are_inherited() -> None:
    """As a program inherits them that is started."""
    source = (
        "import signal; print(signal.getsignal(signal.SIGTERM), signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    )
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert run("-c", source) == run("-c", source, executable=None)
    finally:
        signal.signal(signal.SIGTERM, before)
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR2])
    try:
        assert run("-c", source) == run("-c", source, executable=None)
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGUSR2])


async def test_short_programs_are_never_missed() -> None:
    """Each exit code is seen, also of programs that end before anybody waits for them."""

    async def end(code: int) -> int:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", f"import os; os._exit({code})"), executable=FORKED
        )
        return await process.wait()

    assert await asyncio.gather(*(end(code) for code in range(20))) == list(range(20))
