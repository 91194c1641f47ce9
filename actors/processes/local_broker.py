"""Starts a broker on this machine if none answers.

A launch has a broker in its own process, which ends with the launch. Programs with rclpy's names expect to
find one that is always there, so they start a process:

    started = ensure_local_broker(find_broker_target())
    if started is not None:
        print(started, file=sys.stderr)

It outlives the program that has started it, and ends when it has been idle. Several programs may do this at
the same moment: one broker listens, and all use it. `keep_local_broker` keeps it from ending before the
program has connected its first node, and between one node and the next.
"""

from __future__ import annotations

import asyncio
import atexit
import os
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final, NamedTuple

from actors.config import environment
from actors.errors import BrokerUnreachable
from actors.graph.inspector import inspector_for
from proto.errors import CallboardError, ProtocolError
from proto.untrusted_text import escape
from proto.wire.addresses import is_loopback
from proto.wire.url import LOOPBACK_HOSTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.config.contexts import BrokerTarget
    from proto.wire.url import BrokerUrl

IDLE_SEC: Final = 10
"""Seconds without a client after which the broker ends."""
ANSWER_TIMEOUT_SEC: Final = 2.0
"""How long a broker that listens may take to answer."""
START_TIMEOUT_SEC: Final = 20.0
"""How long a new broker may take to listen."""
STOP_TIMEOUT_SEC: Final = 2.0
"""How long one that has not listened in time may take to end, before it is killed."""
MAX_LOG_BYTES: Final = 1024 * 1024
"""A longer log is emptied at the next start."""
MAX_QUOTED_BYTES: Final = 4096
"""Bytes of the log that the error quotes if a broker does not start."""
_SERVICE_VARIABLES: Final = ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "LISTEN_FDS", "LISTEN_PID")
"""Variables from the service manager of the program that starts the broker. A broker that inherited them
would report its own state as the program's."""


class BrokerStartError(CallboardError):
    """A broker was started and does not listen; the text has its output."""

    is_operational = True


class LocalBroker(NamedTuple):
    """A broker that was started.

    Attributes:
        url: Where it listens.
        pid: Its process.
        log: Its log file; "" if it could not be opened.
    """

    url: str
    pid: int
    log: str

    def __str__(self) -> str:
        log = f", log {self.log}" if self.log else ""
        return f"Started a broker at {self.url} (pid {self.pid}{log}), which ends when idle for {IDLE_SEC} s"


def can_start_at(url: BrokerUrl) -> bool:
    """Return whether a broker of this machine can listen there: it has no certificate, so not with TLS."""
    return not url.tls and bool(url.path or url.host in LOOPBACK_HOSTS or is_loopback(url.host))


async def broker_is_there(target: BrokerTarget) -> bool:
    """Return whether a broker answers at one of its URLs. The loop goes on meanwhile.

    Raises:
        BrokerUnreachable: Something listens there that does not answer as a broker does.
        NotAuthorized: The broker requires other credentials.
    """
    return await asyncio.to_thread(_answers, target)


def ensure_local_broker(
    target: BrokerTarget, *, start_timeout_sec: float = START_TIMEOUT_SEC
) -> LocalBroker | None:
    """Start a broker if none answers and one can be started there.

    None is started for another machine, for TLS, which needs a certificate, or where something else listens:
    the error of a node that connects says so.

    Args:
        target: The broker that nodes are to use.
        start_timeout_sec: How long it may take to listen, in seconds.

    Returns:
        The broker; None if none was started, or another process has started one meanwhile.

    Raises:
        BrokerStartError: The broker does not listen.
    """
    if not _can_start(target) or _something_listens(target):
        return None
    url = target.urls[0]
    with _open_log(url) as log:
        before = log.seek(0, os.SEEK_END)
        process = _start(_command(url), log)
        if _listens(process, start_timeout_sec):
            return LocalBroker(str(url), process.pid, log.name if isinstance(log.name, str) else "")
        if _something_listens(target):
            return None  # another process has started one meanwhile
        log.seek(before)
        output = escape(log.read(MAX_QUOTED_BYTES).decode(errors="replace").strip().replace("\n", "; "))
    raise BrokerStartError(
        f"Cannot start a broker at {url}: {output or f'it has not listened within {start_timeout_sec:g} s'}"
    )


def keep_local_broker(target: BrokerTarget) -> None:
    """Keep a connection open for the life of this process, so that a local broker is not idle.

    Does nothing if none answers, or if a broker could not be started there. A thread answers the broker; it
    ends with the process, or with the broker.

    Args:
        target: The broker that nodes are to use.
    """
    if not _can_start(target):
        return
    inspector = inspector_for(target, ANSWER_TIMEOUT_SEC)
    with suppress(BrokerUnreachable, ProtocolError):  # a node that connects says what is wrong
        inspector.connect()
        atexit.register(inspector.close)
        threading.Thread(target=inspector.stay_connected, name="local-broker", daemon=True).start()


def _can_start(target: BrokerTarget) -> bool:
    return all(map(can_start_at, target.urls))


def _answers(target: BrokerTarget) -> bool:
    inspector = inspector_for(target, ANSWER_TIMEOUT_SEC)
    try:
        with inspector:
            return True
    except BrokerUnreachable:
        if inspector.listening is not None:
            raise
        return False


def _something_listens(target: BrokerTarget) -> bool:
    """Return whether something listens: a broker, also one that refuses, or another program."""
    try:
        return _answers(target)
    except (BrokerUnreachable, ProtocolError):
        return True


def _command(url: BrokerUrl) -> tuple[str, ...]:
    address_options = ("--unix", url.path) if url.path else ("--host", url.host, "--port", str(url.port))
    # -P: otherwise a folder "broker" in the current directory would be run.
    return (sys.executable, "-P", "-m", "broker", *address_options, "--exit-when-idle", str(IDLE_SEC))


def _open_log(url: BrokerUrl) -> IO[bytes]:
    """Open the log of brokers at a URL; a file without a name if there can be none."""
    folder = Path(environment.state_folder(), "brokers")
    name = "".join(char if char.isalnum() else "-" for char in str(url).partition("//")[2].strip("/"))
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        log = (folder / f"{name[-200:]}.log").open("a+b")
    except OSError:
        return tempfile.TemporaryFile()
    if log.seek(0, os.SEEK_END) > MAX_LOG_BYTES:
        log.truncate(0)
    return log


def _start(command: Sequence[str], log: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start a process in a session of its own, so that Ctrl-C and a closed terminal do not end it."""
    return subprocess.Popen(  # noqa: S603 - this interpreter, and an address
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=log,
        env={name: value for name, value in os.environ.items() if name not in _SERVICE_VARIABLES},
        start_new_session=True,
    )


def _listens(process: subprocess.Popen[bytes], timeout_sec: float) -> bool:
    """Wait until a broker says that it listens; return whether it does, and end it if it does not."""
    lines: list[bytes] = []
    assert process.stdout is not None
    with process.stdout as stream:
        reader = threading.Thread(target=lambda: lines.append(stream.readline()), daemon=True)
        reader.start()
        reader.join(timeout_sec)
        listens = any(lines)
        if not listens:
            _end(process)
        reader.join()
    if listens:
        process.returncode = 0  # nobody waits for it: without this, Popen warns that it still runs
    return listens


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_TIMEOUT_SEC)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
