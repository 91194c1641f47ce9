"""Ports that a test has for itself, also while nothing listens there."""

from __future__ import annotations

import random
import socket
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Generator


def hold_port() -> socket.socket:
    """Return a socket that holds a free port of 127.0.0.1 until it is closed.

    Other workers and other runs on this machine choose ports at the same time, and brokers are stopped and
    started again. The port is outside the range of ephemeral ports, and the socket does not listen, so that
    servers, which set SO_REUSEADDR, may listen there.
    """
    while True:
        holder = socket.socket()
        try:
            holder.bind(("127.0.0.1", random.SystemRandom().randrange(20_000, 30_000)))
        except OSError:
            holder.close()
            continue
        # Set afterwards: another holder, which binds without it, is refused.
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        return holder


@contextmanager
def held_port() -> Generator[int]:
    """A port that is held until the end of the block."""
    with hold_port() as holder:
        yield holder.getsockname()[1]
