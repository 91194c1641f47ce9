"""What the client asks of the fork server, and how it travels."""

from __future__ import annotations

import pickle
import socket
import struct
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

HEADER: Final = struct.Struct("!IB")
"""Bytes of the request, and how many descriptors come with this header."""

ANSWER: Final = struct.Struct("!i")
"""The child's process id; 0: it could not be prepared, and its traceback is on the server's stderr."""

READ_EARLY: Final = (
    *(b"PYTHON", b"LC_", b"LANG", b"LD_", b"TZ", b"GLIBC_", b"MALLOC_", b"OPENSSL_", b"SSL_"),
    b"_ROS_WHEELS_",  # unless it is set, those of ROS 2 start Python again, with a path of libraries
)
"""Beginnings of the variables that are read before a program runs."""

HANDLED: Final = (b"PYTHONPATH", b"PYTHONUNBUFFERED")
"""Those that may have another value than the server's."""


class Request(NamedTuple):
    """A program and its surroundings.

    Attributes:
        command: The whole command line.
        unbuffered: Whether -u is among it.
        kind: "-c", "-m" or "" (a script).
        program: Source text, module name or path.
        arguments: The command line after that.
        folder: The working directory.
        environment: All environment variables.
        new_session: Whether it starts a session.
        process_group: The process group that it enters; 0: one of its own, -1: the server's.
        umask: Its umask; -1: the server's.
        limits: Soft and hard limits of resources (setrlimit(2)).
        numbers: The numbers that its descriptors get, the standard streams first.
    """

    command: list[str]
    unbuffered: bool
    kind: str
    program: str
    arguments: list[str]
    folder: str
    environment: dict[bytes, bytes]
    new_session: bool
    process_group: int
    umask: int
    limits: dict[int, tuple[int, int]]
    numbers: list[int]


def read_early(environment: Mapping[bytes, bytes]) -> dict[bytes, bytes]:
    """Return the variables that must be those of the server."""
    return {
        key: value for key, value in environment.items() if key.startswith(READ_EARLY) and key not in HANDLED
    }


def send(channel: socket.socket, request: Request, descriptors: Sequence[int]) -> None:
    """Send a request and its open files."""
    body = pickle.dumps(tuple(request))
    socket.send_fds(channel, [HEADER.pack(len(body), len(descriptors))], descriptors)
    channel.sendall(body)


def receive(channel: socket.socket) -> tuple[Request, list[int]] | None:
    """Receive a request and its open files; return None when the client has ended."""
    header, descriptors, _, _ = socket.recv_fds(channel, HEADER.size, 255)
    if not header:
        return None
    size, count = HEADER.unpack(header)
    assert len(descriptors) == count
    return Request(*pickle.loads(receive_exactly(channel, size))), descriptors


def receive_exactly(channel: socket.socket, size: int) -> bytes:
    """Receive so many bytes.

    Raises:
        EOFError: The other side has ended.
    """
    received = bytearray()
    while len(received) < size:
        part = channel.recv(size - len(received))
        if not part:
            raise EOFError
        received += part
    return bytes(received)
