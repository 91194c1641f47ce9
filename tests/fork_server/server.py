"""A process that has imported callboard and forks at each request; the child runs a Python program.

Starting Python and importing callboard takes 0.2 s of CPU, a fork a small part of that. A test must not see
the difference, apart from the modules that are loaded already:

- The server is a single thread without an event loop, and runs no code of callboard but its imports. So a
  child inherits no lock that another thread holds, no loop, no connection, and nothing chosen at random but
  the hash seed; the `random` module seeds itself after a fork.
- The server's objects are frozen (`gc.freeze`). The child's garbage collector would touch, and so copy, all
  their pages.
- The child's parent is the client, as after a real start. The server forks twice; the process in between ends
  while the client is the subreaper (prctl(2)), so the kernel hands the child over. Exit codes, signals,
  zombies and pidfds are therefore the kernel's own: nobody relays them, and nothing can be missed.
- The child is in its session, folder and environment before the client learns its id, so that the client can
  signal its group at once. It runs the program when it has been handed over, so that the program never sees
  another parent.
- The child closes all descriptors but those of the request, because a copy of a pipe hides the end of its
  owner. It opens the standard streams again. The server writes nothing, so no buffer is copied.
- The frames of this module are cut from the traceback of an uncaught exception. What follows, from SystemExit
  to the finalization of the interpreter, is Python's own: this module just ends. Only the modules that the
  server has imported are not destroyed at the end.
"""

from __future__ import annotations

import atexit
import ctypes
import fcntl
import gc
import importlib
import io
import os
import pkgutil
import resource
import runpy
import socket
import sys
import types
from contextlib import suppress
from importlib.machinery import BuiltinImporter, SourceFileLoader
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tests.fork_server.request import ANSWER, Request, read_early, receive

if TYPE_CHECKING:
    from collections.abc import Sequence

LATE: Final = ("actors.cli.commands.top.",)
"""Modules that few programs need, and that take long."""

ROOTS: Final = frozenset({"__main__", "builtins", "sys"})
"""Modules that the interpreter finalizes in a way of their own."""


def main() -> None:
    """Serve the client at the socket whose number is the first argument; in children, run programs.

    The other arguments are the modules to import, `.*` with all modules of a package.
    """
    channel = socket.socket(fileno=int(sys.argv[1]))
    _import_modules(*sys.argv[2:])
    own = _python_path()
    sys.path[:] = [each for each in sys.path[1:] if each not in own]  # the first is that of this program
    _keep_modules()
    gc.collect()
    gc.freeze()
    request = _serve(channel)
    if request is not None:
        _run(request)


def _import_modules(*names: str) -> None:
    """Import modules with all names that they offer; for those of packages, the modules are enough."""
    for name in names:
        module = importlib.import_module(name.removesuffix(".*"))
        if name.endswith(".*"):
            for found in pkgutil.walk_packages(module.__path__, f"{module.__name__}."):
                if not found.name.startswith(LATE):
                    importlib.import_module(found.name)
        else:
            for each in dir(module):
                getattr(module, each)


def _keep_modules() -> None:
    """Let children forget what is imported by now instead of destroying it at their end.

    Destroying it would touch, and so copy, nearly all pages: 20 ms. What a program itself has made and
    imported is destroyed as usual.
    """
    modules = {name: module for name, module in sys.modules.items() if name not in ROOTS}
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(modules))

    def forget() -> None:
        for name in modules:
            sys.modules.pop(name, None)

    atexit.register(forget)  # the first to be registered is the last to be called


def _serve(channel: socket.socket) -> Request | None:
    """Fork at each request; return it in the child, and None when the client has ended."""
    while (received := receive(channel)) is not None:
        request, descriptors = received
        report, reporting = os.pipe()
        gate, opening = os.pipe()
        between = os.fork()
        if between == 0:
            if os.fork() != 0:
                os._exit(0)
            channel.detach()  # `_prepare` closes it
            _prepare(request, descriptors, reporting, gate)
            return request
        os.waitpid(between, 0)  # the child is the client's now
        for number in (reporting, gate, *descriptors):
            os.close(number)
        channel.sendall(os.read(report, ANSWER.size) or ANSWER.pack(0))
        os.close(report)
        os.close(opening)
    return None


def _prepare(request: Request, descriptors: Sequence[int], reporting: int, gate: int) -> None:
    """In the child: put it in its surroundings, report its id, and wait until it has been handed over."""
    if request.new_session:
        os.setsid()
    if request.process_group >= 0:
        os.setpgid(0, request.process_group)
    if request.umask >= 0:
        os.umask(request.umask)
    for number, limits in request.limits.items():
        if resource.getrlimit(number) != limits:
            resource.setrlimit(number, limits)
    os.chdir(request.folder)
    early = read_early(os.environb)  # those that starting the interpreter has set are the child's, too
    os.environb.clear()
    os.environb.update({**early, **request.environment})
    reporting, gate = _place(request.numbers, descriptors, reporting, gate)
    _open_streams(unbuffered=request.unbuffered or bool(os.environ.get("PYTHONUNBUFFERED")))
    os.write(reporting, ANSWER.pack(os.getpid()))
    os.close(reporting)
    os.read(gate, 1)  # ends when the server closes the other end
    os.close(gate)


def _place(numbers: Sequence[int], descriptors: Sequence[int], *kept: int) -> list[int]:
    """Give descriptors their numbers and close all others; return those of the kept ones."""
    above = max(numbers) + 1  # first out of the way: a number may be that of another descriptor
    moved = [fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, above) for each in descriptors]
    still = [fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, above) for each in kept]
    for number, descriptor in zip(numbers, moved, strict=True):
        os.dup2(descriptor, number)
    for number in {int(name) for name in os.listdir("/proc/self/fd")} - {*numbers, *still}:  # noqa: PTH208
        with suppress(OSError):  # that of the listing
            os.close(number)
    return still


def _open_streams(*, unbuffered: bool) -> None:
    """Open sys.stdin, sys.stdout and sys.stderr as CPython's `create_stdio` does."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        before = getattr(sys, name)
        number = before.fileno()
        direct = unbuffered and mode == "w"
        binary: Any = open(number, f"{mode}b", 0 if direct else -1, closefd=False)  # noqa: SIM115
        (binary if direct else binary.raw).name = f"<{name}>"
        stream: Any = io.TextIOWrapper(
            binary,
            before.encoding,
            before.errors,
            "\n",
            line_buffering=not direct and (binary.isatty() or name == "stderr"),
            write_through=unbuffered,
        )
        stream.mode = mode
        setattr(sys, name, stream)
        setattr(sys, f"__{name}__", stream)


def _run(request: Request) -> None:
    """Run the program as the interpreter's command line does."""
    module = types.ModuleType("__main__")
    vars(module).update(__annotations__={}, __loader__=BuiltinImporter)
    sys.modules["__main__"] = module
    sys.executable, sys.orig_argv = request.command[0], request.command
    sys.argv = [request.kind or request.program, *request.arguments]
    sys.path[:] = [_search_first(request), *dict.fromkeys([*_python_path(), *sys.path])]
    importlib.invalidate_caches()  # folders may have changed since the server looked
    try:
        if request.kind == "-m":
            runpy._run_module_as_main(request.program)  # type: ignore[attr-defined] # noqa: SLF001 - what `-m` calls
            return
        name, source = "<string>", request.program.encode()
        if not request.kind:
            name = str(Path(request.program).absolute())
            source = Path(name).read_bytes()
            vars(module).update(__file__=name, __cached__=None, __loader__=SourceFileLoader("__main__", name))
        exec(compile(source, name, "exec", dont_inherit=True), vars(module))
    except SystemExit:
        raise
    except BaseException:
        _cut_traceback()
        raise


def _python_path() -> list[str]:
    """Return the folders in PYTHONPATH, as Python adds them to sys.path."""
    folders = os.environ.get("PYTHONPATH")
    return [str(Path(each).absolute()) for each in folders.split(os.pathsep)] if folders else []


def _search_first(request: Request) -> str:
    """Return the first entry of sys.path."""
    if request.kind == "-c":
        return ""
    return str(Path.cwd() if request.kind == "-m" else Path(request.program).resolve().parent)


def _cut_traceback() -> None:
    """Let an uncaught exception be shown without the frames of this module."""
    show = sys.excepthook

    def show_cut(kind: Any, error: Any, trace: Any) -> None:
        below = rest = trace
        while rest is not None:
            below, rest = (
                (rest.tb_next if rest.tb_frame.f_code.co_filename == __file__ else below),
                rest.tb_next,
            )
        show(kind, error.with_traceback(below), below)

    sys.excepthook = show_cut


if __name__ == "__main__":
    main()
