"""Visitors of a page that measure what happens to them: `python -m tests.hostile.visitors PAGE TOKEN ...`.

They come from 127.0.0.2, where no attack comes from. A probe asks `/healthz` on a new connection each time,
a signed-in user asks for the graph, and now and then for the page and a stream. Users with further tokens
sign in, one after the other. Like `innocents.py` they stop when standard input ends, and print JSON.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Final

import aiohttp

RATE_HZ: Final = 50
SELDOM: Final = 25
"""Of so many ticks, the user asks for the page and a stream in one, and another user signs in."""
ADDRESS: Final = "127.0.0.2"
TIMEOUT_SEC: Final = 10.0


class Visitors:
    """Requests and their samples: pairs of the time of sending and the latency, in seconds.

    Args:
        page: The page's URL.
        token: Of its user.
        others: Of users who sign in.
    """

    def __init__(self, page: str, token: str, *others: str) -> None:
        kinds = ("probe", "graph", "page", "stream", *(("sign-in",) if others else ()))
        self.samples: dict[str, list[tuple[float, float]]] = {kind: [] for kind in kinds}
        self._others = others
        self.failed = 0
        self.failures: dict[str, int] = {}
        self._page = page
        self._headers = {"Authorization": f"Bearer {token}"}
        self._requests: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Ask until standard input ends; then wait for the answers."""
        timeout = aiohttp.ClientTimeout(total=TIMEOUT_SEC)
        probes = aiohttp.TCPConnector(local_addr=(ADDRESS, 0), force_close=True, ssl=False)
        graph = aiohttp.TCPConnector(local_addr=(ADDRESS, 0), ssl=False, limit=2)
        async with (
            aiohttp.ClientSession(connector=probes, timeout=timeout) as prober,
            aiohttp.ClientSession(connector=graph, timeout=timeout, headers=self._headers) as user,
        ):
            end = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
            began, ticks = time.monotonic(), 0
            while not end.done():
                ticks += 1
                self._start("probe", prober, "/healthz")
                self._start("graph", user, "/api/topics")
                if not ticks % SELDOM:
                    self._start("page", user, "/")
                    self._start("stream", user, "/api/log", until_end=False)
                    if self._others:
                        token = self._others[ticks // SELDOM % len(self._others)]
                        self._start("sign-in", prober, "/api/session", json={"token": token})
                await asyncio.sleep(began + ticks / RATE_HZ - time.monotonic())
            if self._requests:
                await asyncio.wait(self._requests)

    def _start(
        self,
        kind: str,
        session: aiohttp.ClientSession,
        path: str,
        *,
        until_end: bool = True,
        json: dict[str, str] | None = None,
    ) -> None:
        task = asyncio.create_task(self._ask(kind, session, path, until_end=until_end, body=json))
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)

    async def _ask(
        self,
        kind: str,
        session: aiohttp.ClientSession,
        path: str,
        *,
        until_end: bool,
        body: dict[str, str] | None,
    ) -> None:
        began = time.monotonic()
        method = "GET" if body is None else "POST"
        try:
            async with session.request(method, self._page + path, json=body) as answer:
                answer.raise_for_status()
                if until_end:
                    await answer.read()
        except (aiohttp.ClientError, TimeoutError) as error:
            self.failed += 1
            reason = f"{kind}: {getattr(error, 'status', type(error).__name__)}"
            self.failures[reason] = self.failures.get(reason, 0) + 1
        else:
            self.samples[kind].append((began, time.monotonic() - began))


async def main() -> None:
    """Run, and print the samples."""
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    visitors = Visitors(*sys.argv[1:])
    await visitors.run()
    found = {"lost": 0, "failed": visitors.failed, "failures": visitors.failures, "samples": visitors.samples}
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    asyncio.run(main())
