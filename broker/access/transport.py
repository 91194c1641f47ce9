"""Asks a connection's transport where the connection comes from."""

from __future__ import annotations

import os
import socket
import struct
from typing import TYPE_CHECKING, Any, Final, cast

from broker.access.origin import LOCAL, UNKNOWN, Origin, certificate_names
from proto.addresses import parse_address

if TYPE_CHECKING:
    from collections.abc import Callable

    from proto.addresses import Address

_PEER_CREDENTIALS: Final = struct.Struct("3i")
"""Linux: process, user and group of the other end of a unix socket."""


def origin_of(extra_info: Callable[[str], Any]) -> Origin:
    """Return where a connection comes from.

    Args:
        extra_info: `get_extra_info` of its transport.
    """
    sock = extra_info("socket")
    if sock is not None and sock.family == getattr(socket, "AF_UNIX", None):
        return LOCAL
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
    """Return the other end's host and port, or "unix socket", for people.

    Args:
        extra_info: `get_extra_info` of its transport.
    """
    name: tuple[str, int] | str | None = extra_info("peername")
    return f"{name[0]}:{name[1]}" if isinstance(name, tuple) else "unix socket"


def is_same_user(extra_info: Callable[[str], Any]) -> bool:
    """Return whether the other end of a unix socket runs as this user, or as root.

    Args:
        extra_info: `get_extra_info` of its transport.

    Returns:
        True also where the platform does not say; there the mode of the file must suffice.
    """
    option = getattr(socket, "SO_PEERCRED", None)
    sock = extra_info("socket")
    if option is None or sock is None:
        return True
    _, user, _ = _PEER_CREDENTIALS.unpack(sock.getsockopt(socket.SOL_SOCKET, option, _PEER_CREDENTIALS.size))
    return user in {0, os.geteuid()}
