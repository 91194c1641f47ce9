"""Listen at a port or at a socket file; of several brokers that try at once, exactly one succeeds."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import stat
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Final

from broker.errors import ListenError, address_in_use_error, listen_error, unprotected_error
from broker.serving.link import logger
from broker.serving.probe import find_broker
from proto.aio.forks import drop_in_children
from proto.aio.local_socket import listen_beside
from proto.wire.addresses import is_loopback
from proto.wire.url import LOOPBACK_HOSTS, BrokerUrl

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Iterable
    from pathlib import Path

    from broker.options import BrokerOptions

SOCKET_MODE: Final = 0o600
"""Permissions of a socket file: only its owner may connect."""

LOCK_TRIES: Final = 100
LOCK_PAUSE_SEC: Final = 0.01
"""Pause between tries. A broker holds the lock for a fraction of it."""


class NotASocketError(OSError):
    """The path of the socket file exists and is not a socket."""


class SocketFile:
    """The file of a listening socket, identified by its device and inode."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._identity = _identity(path)

    def remove(self) -> None:
        """Remove the file, unless it is gone or somebody else has put another in its place."""
        if _identity(self._path) != self._identity:
            return
        try:
            self._path.unlink(missing_ok=True)
        except OSError as error:  # such as a folder that has become read-only; the next broker replaces it
            logger.warning("Cannot remove %s: %s", self._path, error.strerror or error)


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


class Listener:
    """The servers that listen, and the URL that leads to them."""

    def __init__(self, url: BrokerUrl, servers: list[asyncio.Server], file: SocketFile | None = None) -> None:
        self.url = url
        self._servers = servers
        self._file = file
        drop_in_children(self)

    def descriptors(self) -> Iterable[int]:
        """DescriptorOwner: its listening sockets."""
        serving = (server for server in self._servers if server.is_serving())
        return [sock.fileno() for server in serving for sock in server.sockets]

    def close(self) -> None:
        """Stop listening."""
        if self._file is not None:  # first: without a listener the file may be replaced by the next broker's
            self._file.remove()
        # The port last: a broker that gets it can get the socket files beside it, too.
        for server in reversed(self._servers):
            server.close()


async def listen(
    options: BrokerOptions, protocol: Callable[[], asyncio.BufferedProtocol], *, backlog: int
) -> Listener:
    """Listen where the options say.

    Args:
        options: The host and port, or the path of the socket file.
        protocol: Makes the protocol of each connection.
        backlog: Connections that the kernel may hold until they are accepted.

    Raises:
        AddressInUseError: Something else listens there.
        UnprotectedError: Other machines could connect, and the options name neither rules, nor authorities
            of client certificates, nor `insecure`.
        ListenError: It cannot listen there for another reason.
    """
    loop = asyncio.get_running_loop()
    url = BrokerUrl(options.host, options.port, tls=options.tls_cert is not None)
    remedy = "Choose another port with --port"
    if options.unix is not None:
        url = BrokerUrl("", 0, str(options.unix))
        remedy = "Choose another path with --unix"
    try:
        if options.unix is not None:
            mode = None if options.insecure else SOCKET_MODE
            server, file = await listen_unix(loop, protocol, options.unix, backlog=backlog, mode=mode)
            return Listener(url._replace(path=str(options.unix.absolute())), [server], file)
        exposed = options.insecure or options.auth is not None or options.tls_client_ca is not None
        server = await listen_tcp(loop, protocol, url.host, url.port, backlog=backlog, exposed=exposed)
        servers = [server]
        if options.local_socket and not url.tls:
            try:
                await _listen_beside(loop, protocol, servers, backlog=backlog)
            except BaseException:
                for each in servers:
                    each.close()
                raise
        return Listener(url._replace(port=server.sockets[0].getsockname()[1]), servers)
    except ListenError:
        raise
    except (OSError, UnicodeError) as error:
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise address_in_use_error(str(url), await find_broker(url), remedy=remedy) from error
        raise listen_error(str(url), error, host=url.host, remedy=remedy) from error


async def listen_tcp(
    loop: asyncio.AbstractEventLoop,
    protocol: Callable[[], asyncio.BufferedProtocol],
    host: str,
    port: int,
    *,
    backlog: int,
    exposed: bool = True,
) -> asyncio.Server:
    """Listen at all addresses of a host; port 0 takes a free one.

    Raises:
        UnprotectedError: One of the addresses is not of the loopback device, and it is not `exposed`.
        OSError: It cannot listen; EADDRINUSE if another process listens there, even if it has just begun.
    """
    server = await loop.create_server(protocol, host, port, backlog=backlog, start_serving=False)
    try:
        if not exposed and host not in LOOPBACK_HOSTS:
            # Bound, but not listening: only now is it known which addresses a name has.
            names = [sock.getsockname() for sock in server.sockets]
            if not all(is_loopback(name[0]) for name in names):
                raise unprotected_error(str(BrokerUrl(host, port or names[0][1])))
        await server.start_serving()
        # Two processes may bind a port as long as neither listens. uvloop does not report the failure to the
        # slower one: its sockets are just gone.
        if not all(server.sockets):
            raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
    except OSError:
        server.close()
        raise
    return server


async def _listen_beside(
    loop: asyncio.AbstractEventLoop,
    protocol: Callable[[], asyncio.BufferedProtocol],
    servers: list[asyncio.Server],
    *,
    backlog: int,
) -> None:
    """Add servers at unix sockets beside the ports of the first one; without them, nodes use the port."""
    for name in [sock.getsockname() for sock in servers[0].sockets]:
        try:
            sock = listen_beside(name[0], name[1], backlog)
        except OSError as error:
            logger.warning("No unix socket beside port %d: %s", name[1], error.strerror or error)
            continue
        if sock is not None:
            servers.append(await loop.create_unix_server(protocol, sock=sock, backlog=backlog))


async def listen_unix(
    loop: asyncio.AbstractEventLoop,
    protocol: Callable[[], asyncio.BufferedProtocol],
    path: Path,
    *,
    backlog: int,
    mode: int | None = None,
    lock_tries: int = LOCK_TRIES,
) -> tuple[asyncio.Server, SocketFile]:
    """Listen at a socket file; replace one that a dead broker has left.

    `mode` are the permissions of the file; None gives those of the umask. `lock_tries` is how often it tries
    to lock the folder before it goes on without.

    Raises:
        NotASocketError: The file exists and is not a socket.
        OSError: It cannot; EADDRINUSE if another listens there.
    """
    # Not the loop's own way to listen: it would remove the file even if another broker listens there.
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        async with _alone_in(path.parent, lock_tries):
            _remove_stale(path)
            _bind(listening, path, mode)
            listening.listen(backlog)
            file = SocketFile(path)
        return await loop.create_unix_server(protocol, sock=listening, backlog=backlog), file
    except BaseException:
        listening.close()
        raise


@asynccontextmanager
async def _alone_in(folder: Path, tries: int) -> AsyncGenerator[None]:
    """Lock a folder, because between bind and listen a socket file looks stale to other brokers.

    Only a few system calls happen under the lock. If the file system has no locks or somebody keeps this one,
    continue without: then only brokers that start at the same moment can disturb each other.
    """
    import fcntl  # noqa: PLC0415 - not on Windows, which has no socket files either

    locked = -1
    try:
        with suppress(OSError):
            locked = os.open(folder, os.O_RDONLY)
        for _ in range(tries if locked >= 0 else 0):
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


def _bind(listening: socket.socket, path: Path, mode: int | None) -> None:
    """Create the socket file. Nobody can connect before it listens."""
    listening.bind(os.fspath(path))
    if mode is not None:
        path.chmod(mode)


def _remove_stale(path: Path) -> None:
    """Remove a socket file that a dead broker has left.

    Raises:
        NotASocketError: The file is not a socket.
        OSError: EADDRINUSE: somebody listens there.
    """
    try:
        mode = path.stat().st_mode
    except OSError:
        return
    if not stat.S_ISSOCK(mode):
        raise NotASocketError("the file exists and is not a socket")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(0)
        try:
            probe.connect(os.fspath(path))
        except BlockingIOError:  # its backlog is full
            pass
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)
            return
        except FileNotFoundError:  # it has just stopped
            return
    raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
