"""Proves to a broker that its client is a process of the broker's user (docs/protocol.md §6.10.2)."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

from proto import limits

if TYPE_CHECKING:
    from collections.abc import Callable


def session_proof(secret: bytes, session: int, ends: bytes) -> bytes:
    """Return the content of PROOF: only a process that has read the broker's secret can compute it.

    Args:
        secret: The broker's secret, as the client has read it.
        session: The number of the session.
        ends: The connection's `connection_ends`. Without them a process of another user that a client takes
            for the broker could repeat the client's proof on a connection of its own.
    """
    said = session.to_bytes(8, "big") + ends
    return hashlib.blake2b(said, key=secret, digest_size=limits.INSTANCE_BYTES).digest()


def connection_ends(extra_info: Callable[[str], Any], *, client: bool) -> bytes:
    """Return the addresses of a connection as both of its ends see them; nothing for a unix socket.

    Args:
        extra_info: `get_extra_info` of its transport.
        client: Whether this is the client's end.
    """
    names: tuple[Any, Any] = extra_info("sockname"), extra_info("peername")
    if not all(isinstance(name, tuple) for name in names):
        return b""
    hosts_and_ports = (name[:2] for name in (names if client else names[::-1]))
    return " ".join(f"{host.removeprefix('::ffff:')} {port}" for host, port in hosts_and_ports).encode()
