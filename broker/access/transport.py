"""Asks a connection's transport where the connection comes from."""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING, Any, cast

from broker.access.origin import LOCAL, UNKNOWN, Origin, certificate_names
from proto.aio.local_socket import address_in, peer_user
from proto.wire.addresses import parse_address

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.wire.addresses import Address


def is_unix(sock: Any) -> bool:
    """Return whether a transport's socket, or None, is a unix socket."""
    return sock is not None and sock.family == getattr(socket, "AF_UNIX", None)


def origin_of(extra_info: Callable[[str], Any]) -> Origin:
    """Return where a connection comes from; the socket beside a port counts as the port.

    Args:
        extra_info: `get_extra_info` of its transport.
    """
    sock = extra_info("socket")
    if is_unix(sock):
        beside = address_in(sock.getsockname())
        return LOCAL if beside is None else Origin(address=parse_address(beside))
    tls = extra_info("ssl_object")
    certificate = None if tls is None else tls.getpeercert()
    name: Any = extra_info("peername")
    try:
        address: Address | None = parse_address(cast("tuple[str, int]", name)[0])
    except (TypeError, ValueError, IndexError):
        address = UNKNOWN.address
    names = certificate_names(certificate or {})
    return Origin(address=address, encrypted=tls is not None, certificate_names=names)


def address_text(extra_info: Callable[[str], Any]) -> str:
    """Return the other end's host and port, or "unix socket", for logs and listings.

    Args:
        extra_info: `get_extra_info` of its transport.
    """
    name: tuple[str, int] | str | None = extra_info("peername")
    return f"{name[0]}:{name[1]}" if isinstance(name, tuple) else "unix socket"


def is_same_user(extra_info: Callable[[str], Any]) -> bool:
    """Return whether the other end of a unix socket runs as this user or as root; True for TCP.

    Args:
        extra_info: `get_extra_info` of its transport.

    Returns:
        True also where the platform does not say; there the mode of the file must suffice.
    """
    sock = extra_info("socket")
    user = peer_user(sock) if is_unix(sock) else None
    return user is None or user in {0, os.geteuid()}
