"""Commands beside a broker, as supervised child processes: the page and the bridge."""

from __future__ import annotations

import asyncio
import sys
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors.processes.child import Child
from actors.processes.supervisor import Supervisor

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Mapping

MAX_RESTARTS: Final = 1000
"""Within `RESTARTS_SEC`: back-off allows fewer, so that the command is always started again."""
RESTARTS_SEC: Final = 5.0


@asynccontextmanager
async def command_beside(
    name: str, *arguments: str, env: Mapping[str, str] | None = None
) -> AsyncGenerator[None]:
    """Run a command of callboard as long as the context; after a crash it is started again, with back-off.

    It has this process's environment, so that it has its credentials, too.

    Args:
        name: Its name in the log.
        arguments: The command and its arguments.
        env: Variables that it has in place of those of the environment.
    """
    command = [sys.executable, "-m", "actors", *arguments]
    supervisor = Supervisor(
        [Child(name, command=command, env=env or {})],
        name=name,
        max_restarts=MAX_RESTARTS,
        restart_window_sec=RESTARTS_SEC,
    )
    # A task of its own: an error of the command must not cancel what it is beside.
    task = asyncio.get_running_loop().create_task(supervisor.run(), name=name)
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])


def web_beside(
    url: str, listen: str, *arguments: str, domain: int | None = None, ca: str = ""
) -> AbstractAsyncContextManager[None]:
    """Return the context of `callboard web`.

    Args:
        url: The broker's.
        listen: Where to serve, as HOST:PORT.
        arguments: Further ones.
        domain: The domain; None for that of the environment.
        ca: The PEM file of what to trust for TLS, in place of that of the environment; "" for that.
    """
    command = ["web", "--no-browser", "--url", url, "--listen", listen, *arguments]
    if domain is not None:
        command += ["--domain", str(domain)]
    return command_beside("web", *command, env={"CALLBOARD_CA": ca} if ca else None)
