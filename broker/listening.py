"""Listening: a server at a port or at a socket file, or an error. Of many who try at once, one gets it."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import stat
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable
    from pathlib import Path

LOCK_TRIES: Final = 100
LOCK_PAUSE_SEC: Final = 0.01
"""Between tries. A broker keeps the lock for a fraction of it."""


class NotASocketError(OSError):
    """Where a socket file is to be made there is another file."""


class SocketFile:
    """The file of a listening socket, told from others of its name by its device and inode."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._identity = _identity(path)

    def remove(self) -> None:
        """Remove the file, unless it is gone or somebody else has put another in its place."""
        if _identity(self._path) == self._identity:
            self._path.unlink(missing_ok=True)


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


async def listen_tcp(
    loop: asyncio.AbstractEventLoop,
    protocol: Callable[[], asyncio.BufferedProtocol],
    host: str,
    port: int,
    *,
    backlog: int,
) -> asyncio.Server:
    """Listen at all addresses of a host; port 0 is any that is free.

    Raises:
        OSError: It cannot; EADDRINUSE if another listens there, even if only just.
    """
    server = await loop.create_server(protocol, host, port, backlog=backlog, start_serving=False)
    try:
        await server.start_serving()
        # Two may bind a port, as long as none listens. To the slower one uvloop does not say that it failed.
        if not all(server.sockets):
            raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
    except OSError:
        server.close()
        raise
    return server


async def listen_unix(
    loop: asyncio.AbstractEventLoop,
    protocol: Callable[[], asyncio.BufferedProtocol],
    path: Path,
    *,
    backlog: int,
) -> tuple[asyncio.Server, SocketFile]:
    """Listen at a socket file; one that a dead broker has left is replaced.

    Raises:
        NotASocketError: The file is there, and is something else.
        OSError: It cannot; EADDRINUSE if another listens there.
    """
    # Not the loop's own way: it takes the file away, whoever listens there.
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        async with _alone_in(path.parent):
            _remove_stale(path)
            listening.bind(os.fspath(path))
            listening.listen(backlog)
            file = SocketFile(path)
        return await loop.create_unix_server(protocol, sock=listening, backlog=backlog), file
    except BaseException:
        listening.close()
        raise


@asynccontextmanager
async def _alone_in(folder: Path) -> AsyncGenerator[None]:
    """Keep other brokers from listening in a folder meanwhile: a file not yet listened at looks stale.

    All that is done under the lock is some system calls. Where there is none, or somebody keeps it, it goes
    without: then only those who start at the same moment can be in each other's way.
    """
    import fcntl  # noqa: PLC0415 - there is none on Windows, and there are no socket files either

    locked = -1
    try:
        with suppress(OSError):
            locked = os.open(folder, os.O_RDONLY)
        for _ in range(LOCK_TRIES if locked >= 0 else 0):
            try:
                fcntl.flock(locked, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                await asyncio.sleep(LOCK_PAUSE_SEC)
            except OSError:  # a file system without locks
                break
        yield
    finally:
        if locked >= 0:
            os.close(locked)


def _remove_stale(path: Path) -> None:
    """Remove a socket file that a dead broker has left; raise if somebody listens, or it is no socket."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return
    if not stat.S_ISSOCK(mode):
        raise NotASocketError("the file exists and is no socket")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(0)
        try:
            probe.connect(os.fspath(path))
        except BlockingIOError:  # so many wait there that it would take a while
            pass
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)
            return
        except FileNotFoundError:  # it has just stopped
            return
    raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
