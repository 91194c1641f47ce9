"""The limit on a broker's connections, and how it refuses more.

A broker without free descriptors cannot even refuse: depending on the loop, clients wait or are disconnected
without an error, and the log fills. So some descriptors stay free, and each refused client gets the reason.
"""

from __future__ import annotations

from typing import Final

from proto.aio import process

RESERVED_FILES: Final = 2048
"""Descriptors for everything except links: standard streams, the loop, the listening socket, shared memory,
and connections that are being refused. At most half of the limit."""

MAX_BACKLOG: Final = 1024
"""Connections that the kernel holds until the broker accepts them."""


class Capacity:
    """The limit on a broker's connections.

    Args:
        wanted: Connections that its options allow.

    Attributes:
        most: Connections that the broker accepts.
        arenas: Descriptors for shared memory: each arena keeps one open.
        backlog: Connections that the kernel may hold for it. asyncio's own loop accepts as many in a row
            before any of them can be refused, so twice as many must fit: refused ones take a while to close.
        refused: Connections turned away so far.
        refusal: Why no more are accepted, for clients and the log.
    """

    def __init__(self, wanted: int) -> None:
        # 0 raises nothing: an embedded broker leaves the limits of its process alone.
        files = process.raise_file_limit(0)
        reserved = min(RESERVED_FILES, files // 2)
        self.most = min(wanted, files - reserved)
        self.arenas = reserved // 4
        self.backlog = min(MAX_BACKLOG, max(1, reserved // 2))
        self.refused = 0
        limit = "--max-connections" if self.most == wanted else "limit of open files, ulimit -n"
        self.refusal = f"this broker accepts at most {self.most} connections (its {limit})"
