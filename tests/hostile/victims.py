"""What is attacked at full size: the processes of a victim, and the bystander that measures beside it.

A module `*attacks.py` has a table `ATTACKS` by name. An attack names its victim: `BROKER`, `MESH`, `PAGE`,
`NODE`, or a `Victim` of its own module.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from contextlib import ExitStack

START_SEC: Final = 20.0
TOKEN: Final = "0123456789abcdef0123456789abcdef"
"""Of the page: it grants control."""


class Started(NamedTuple):
    """A victim that runs.

    Attributes:
        pid: The process whose memory is measured.
        target: The arguments of an attack on it.
        bystander: The arguments of its bystander.
        env: Environment variables of its bystander, beside those of this process.
    """

    pid: int
    target: tuple[str, ...]
    bystander: tuple[str, ...]
    env: Mapping[str, str] | None = None


class Victim(NamedTuple):
    """A kind of victim.

    Attributes:
        name: Of the table.
        start: Starts one, whose files have names that begin with the text.
        bystander: The module that measures: a program like `innocents.py`.
    """

    name: str
    start: Callable[[Processes, str], Started]
    bystander: str = "tests.hostile.innocents"


class Processes:
    """The processes of one measurement.

    Args:
        stack: Kills them in the end.
    """

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))

    def start(self, *command: str, **options: Any) -> Any:
        """Start a Python module; with options as for `program`."""
        return self.program(sys.executable, "-m", *command, **options)

    def program(
        self,
        *command: str,
        stdin: int = subprocess.DEVNULL,
        stdout: int | IO[bytes] = subprocess.DEVNULL,
        env: Mapping[str, str] | None = None,
    ) -> Any:
        """Start any program, with additional environment variables."""
        process = subprocess.Popen(command, stdin=stdin, stdout=stdout, env={**os.environ, **(env or {})})
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def at_end(self, function: Callable[[], object]) -> None:
        """Call a function when the processes that start from now on have ended."""
        self._stack.callback(function)

    def broker(self, name: str, *options: str) -> tuple[int, str]:
        """Start a broker; return its process id and its URL."""
        file = self.folder / name
        command = ("broker", "--port", "0", "--url-file", str(file), "--log-level", "error", *options)
        process = self.start(*command)
        wait_until("a broker", lambda: file.exists() and file.read_text(encoding="utf-8").strip())
        return process.pid, file.read_text(encoding="utf-8").strip()

    def page(self, url: str, *options: str, env: Mapping[str, str] | None = None) -> tuple[int, str]:
        """Start a page for a broker; return its process id and its URL."""
        port = free_port()
        listen = ("--listen", f"127.0.0.1:{port}", "--url", url, "--no-browser", *options)
        process = self.start("actors", "web", *listen, env=env)
        wait_until("the page", lambda: listens(port))
        return process.pid, f"{'https' if '--tls-cert' in options else 'http'}://127.0.0.1:{port}"


def wait_until(what: str, ready: Callable[[], Any]) -> None:
    """Wait for a process that starts.

    Raises:
        TimeoutError: It does not.
    """
    deadline = time.monotonic() + START_SEC
    while not ready():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what} does not start")
        time.sleep(0.02)


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


def listens(port: int) -> bool:
    """Return whether a program listens on a port of 127.0.0.1."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _start_broker(processes: Processes, name: str, *, options: tuple[str, ...] = ()) -> Started:
    pid, url = processes.broker(name, *options)
    return Started(pid, (url,), (url,))


def _start_mesh(processes: Processes, name: str) -> Started:
    """Start two brokers of a mesh. The first is attacked; the innocents talk from one to the other."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    pid, url = processes.broker(name, "--mesh-listen", endpoint, "--mesh-name", "attacked")
    _, honest = processes.broker(f"{name}-honest", "--mesh", endpoint, "--mesh-name", "honest")
    return Started(pid, (endpoint, url), (url, honest))


def _start_page(processes: Processes, name: str, *, options: tuple[str, ...] = ()) -> Started:
    _, url = processes.broker(name)
    token = processes.folder / f"{name}.token"
    token.touch(mode=0o600)
    token.write_text(TOKEN, encoding="ascii")
    pid, page = processes.page(url, "--allow-control", "--token", str(token), *options)
    return Started(pid, (page, url), (page, TOKEN))


def _start_node(processes: Processes, name: str) -> Started:
    """Start a node that serves the innocents' calls; attacks find what it reads in `reader.py`."""
    _, url = processes.broker(name)
    reader = processes.start("tests.hostile.reader", url, stdout=subprocess.PIPE)
    reader.stdout.readline()
    return Started(reader.pid, (url,), (url, "calls"))


BROKER: Final = Victim("broker", _start_broker)
MESH: Final = Victim("mesh", _start_mesh)
PAGE: Final = Victim("page", _start_page, "tests.hostile.visitors")
NODE: Final = Victim("node", _start_node)


def page_with(name: str, *options: str) -> Victim:
    """Return a page that is started with further options."""
    return PAGE._replace(name=name, start=partial(_start_page, options=options))


def broker_with(name: str, *options: str) -> Victim:
    """Return a broker that is started with further options."""
    return BROKER._replace(name=name, start=partial(_start_broker, options=options))


class Attack(NamedTuple):
    """One attack.

    Attributes:
        case: Its number in README.md.
        run: Attacks until it is killed; called again when it returns. Its arguments are the target's.
        memory_mib: What the victim may need for it beyond what it had.
        victim: What is attacked.
        peers: Other software that it fits.
    """

    case: int
    run: Callable[..., None]
    memory_mib: int = 300
    victim: Victim = BROKER
    peers: tuple[Victim, ...] = ()
