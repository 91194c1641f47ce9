"""Connects sockets for blocking clients of a broker."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from proto.wire.url import BrokerUrl


def connected_socket(url: BrokerUrl, timeout_sec: float) -> socket.socket:
    """Connect a blocking socket.

    Args:
        url: The broker. TLS begins later, on the socket.
        timeout_sec: How long it may take, in seconds; also the socket's timeout.

    Raises:
        OSError: Nobody listens there, or the host is unknown.
    """
    if not url.path:
        # As bytes an ASCII name goes as it is; the codec for others takes some milliseconds to be imported.
        host: Any = url.host.encode() if url.host.isascii() else url.host
        try:
            return socket.create_connection((host, url.port), timeout_sec)
        except UnicodeError as error:
            raise socket.gaierror(socket.EAI_NONAME, f"no host can be called {url.host!r}") from error
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.settimeout(timeout_sec)
        sock.connect(url.path)
    except BaseException:
        sock.close()
        raise
    return sock
