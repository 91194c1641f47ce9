"""`callboard web` as a supervised child process."""

from __future__ import annotations

import asyncio
import sys
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors.processes.child import Child
from actors.processes.supervisor import Supervisor

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

MAX_RESTARTS: Final = 1000
"""Within `RESTARTS_SEC`: back-off allows fewer, so that the page is always started again."""
RESTARTS_SEC: Final = 5.0


@asynccontextmanager
async def web_beside(
    url: str, listen: str, *arguments: str, domain: int | None = None, ca: str = ""
) -> AsyncGenerator[None]:
    """Run `callboard web` as long as the context; after a crash it is started again, with back-off.

    It has this process's environment, so that it has its credentials, too.

    Args:
        url: The broker's.
        listen: Where to serve, as HOST:PORT.
        arguments: Further ones.
        domain: The domain; None for that of the environment.
        ca: The PEM file of what to trust for TLS, in place of that of the environment; "" for that.
    """
    command = [sys.executable, "-m", "actors", "web", "--no-browser", "--url", url, "--listen", listen]
    command += arguments
    if domain is not None:
        command += ["--domain", str(domain)]
    supervisor = Supervisor(
        [Child("web", command=command, env={"CALLBOARD_CA": ca} if ca else {})],
        name="web",
        max_restarts=MAX_RESTARTS,
        restart_window_sec=RESTARTS_SEC,
    )
    # A task of its own: an error of the page must not cancel what it shows.
    task = asyncio.get_running_loop().create_task(supervisor.run(), name="web")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait([task])
