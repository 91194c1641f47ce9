"""Many idle connections from one process: the bytes of a peer's handshake on plain sockets.

Only the server is measured, so that the cheapest client will do: it says what the protocol wants and then
holds still.
"""

from __future__ import annotations

import asyncio
import resource
from collections.abc import Awaitable, Callable

from benchmarks.peers.roles import Parameters, Parent, until

SPARE_FILES = 100
AT_A_TIME = 50
"""Fewer than any server's accept queue holds."""
HANDSHAKE_S = 30

Handshake = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


def allow_files(connections: int) -> None:
    """Raise this process's file limit, as far as it may be raised."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, connections + SPARE_FILES)), hard))


async def hold_connections(parent: Parent, parameters: Parameters, handshake: Handshake) -> None:
    """Open the connections, say `ready`, and hold them until the parent closes our stdin."""
    allow_files(parameters.connections)
    writers: list[asyncio.StreamWriter] = []

    async def connect() -> None:
        async with asyncio.timeout(HANDSHAKE_S):
            reader, writer = await asyncio.open_connection(parameters.host, parameters.port)
            writers.append(writer)
            await handshake(reader, writer)

    try:
        for start in range(0, parameters.connections, AT_A_TIME):
            async with asyncio.TaskGroup() as group:
                for _ in range(min(AT_A_TIME, parameters.connections - start)):
                    group.create_task(connect())
        parent.ready()
        await until(parent.closed)
        parent.done(messages=0, connections=len(writers))
    finally:
        for writer in writers:
            writer.close()
