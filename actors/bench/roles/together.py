"""A publisher and a subscriber, or a server and a requester, as two nodes of one process."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.bench.roles import requests, stream
from actors.bench.roles.parent import Load

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from actors.bench.roles.parent import Parent


class Half:
    """What one of the two roles takes for its parent.

    Attributes:
        there: Set when the role is ready.
        go: To be set when it may begin.
        over: To be set when a role that serves shall end.
    """

    def __init__(self) -> None:
        self.there, self.go, self.over = asyncio.Event(), asyncio.Event(), asyncio.Event()

    async def ready(self) -> None:
        """Parent: be ready, and wait for `go`."""
        self.there.set()
        await self.go.wait()

    async def gone(self) -> None:
        """Parent: wait for the end."""
        await self.over.wait()


async def _play(
    parent: Parent,
    first: Callable[[Any], Awaitable[dict[str, float]]],
    second: Callable[[Any], Awaitable[Any]],
) -> tuple[Load, dict[str, float], dict[str, float]]:
    """Play both roles; the first must be ready before the second starts, and ends last."""
    halves = Half(), Half()
    async with asyncio.TaskGroup() as group:
        tasks: list[asyncio.Future[dict[str, float]]] = []
        for play, half in zip((first, second), halves, strict=True):
            tasks.append(group.create_task(_run(play, half)))
            await half.there.wait()
        await parent.ready()
        load = Load()
        for half in halves:
            half.go.set()
        figures = await tasks[1]
        halves[0].over.set()
        return load, await tasks[0], figures


async def _run(play: Callable[[Any], Awaitable[dict[str, float]]], half: Half) -> dict[str, float]:
    try:
        return await play(half)
    finally:
        half.there.set()  # one that fails is waited for no longer


async def stream_together(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish and subscribe as `stream.publisher` and `stream.subscriber` do."""
    load, received, sent = await _play(
        parent,
        lambda half: stream.subscriber({**parameters, "subscriptions": 1}, half),
        lambda half: stream.publisher({**parameters, "readers": 1}, half),
    )
    return {**received, **load.figures(int(received["received"])), "sent": sent["sent"]}


async def calls_together(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Serve and call as `requests.server` and `requests.requester` do."""
    load, _, called = await _play(
        parent,
        lambda half: requests.server(parameters, half),
        lambda half: requests.requester(parameters, half),
    )
    return {**called, **load.figures(int(called["calls"]))}
