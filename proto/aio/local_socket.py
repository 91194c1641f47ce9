"""The unix socket beside a TCP port of the loopback device (docs/protocol.md §2.6).

It saves clients on the broker's machine the work of TCP. Its name is abstract, which only Linux has: there is
no file, the name ends with the broker, and it belongs to a network namespace, as the port does. Since anybody
may listen at such a name or connect to it, both ends ask the kernel who the other is.
"""

from __future__ import annotations

import os
import socket
import struct
import sys
from typing import Final

PREFIX: Final = b"\0callboard-"
"""How each name begins. The zero byte makes it abstract."""

HOSTS: Final = {"127.0.0.1": "127.0.0.1", "localhost": "127.0.0.1", "::1": "::1"}
"""The hosts in URLs that lead there, and the addresses that the names have."""

_CREDENTIALS: Final = struct.Struct("3i")
"""Process, user and group of the other end."""


def local_name(address: str, port: int) -> bytes:
    """Return the name of the socket beside a port, for clients and brokers of this user.

    Args:
        address: One of the addresses in `HOSTS`.
        port: The TCP port.
    """
    return b"%s%d-%s:%d" % (PREFIX, os.geteuid(), address.encode(), port)


def address_in(name: object) -> str | None:
    """Return the address in the name of a socket; None if it does not begin with `PREFIX`."""
    if not (isinstance(name, bytes) and name.startswith(PREFIX)):
        return None
    return name.partition(b"-")[2].partition(b"-")[2].rpartition(b":")[0].decode()


def peer_user(sock: socket.socket) -> int | None:
    """Return the user of the process at the other end of a unix socket; None if the platform does not say."""
    option = getattr(socket, "SO_PEERCRED", None)
    if option is None:
        return None
    return int(_CREDENTIALS.unpack(sock.getsockopt(socket.SOL_SOCKET, option, _CREDENTIALS.size))[1])


def connect_beside(host: str, port: int) -> socket.socket | None:
    """Return a connection to the socket beside a port, or None if no broker of this user accepts it now.

    Args:
        host: As in a URL.
        port: The TCP port.
    """
    address = HOSTS.get(host)
    if address is None or sys.platform != "linux":
        return None
    try:
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    except OSError:  # such sockets are forbidden here
        return None
    sock.settimeout(0)
    try:
        sock.connect(local_name(address, port))
        if peer_user(sock) == os.geteuid():
            return sock
    except OSError:  # nobody listens, or too many wait there: with TCP the caller finds out
        pass
    sock.close()
    return None


def listen_beside(address: str, port: int, backlog: int) -> socket.socket | None:
    """Return a socket that listens beside a port; None where no client would look for it.

    Args:
        address: The address that the port is bound to.
        port: The TCP port.
        backlog: Connections that the kernel may hold until they are accepted.

    Raises:
        OSError: It cannot; EADDRINUSE if another process has the name.
    """
    address = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(address, address)  # noqa: S104 - it is compared
    if address not in HOSTS.values() or sys.platform != "linux":
        return None
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.bind(local_name(address, port))
        sock.listen(backlog)
    except OSError:
        sock.close()
        raise
    return sock
