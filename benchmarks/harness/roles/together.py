"""A publisher and a subscriber, or a server and a requester, as two nodes of one process."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from benchmarks.harness.roles import requests, stream
from benchmarks.harness.roles.parent import Load

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from benchmarks.harness.roles.parent import Parent


class RoleParent:
    """Stands in for the parent of one of the two roles.

    Attributes:
        role_ready: Set when the role is ready.
        begin: To be set when it may begin.
        end: To be set when a role that serves must end.
    """

    def __init__(self) -> None:
        self.role_ready, self.begin, self.end = asyncio.Event(), asyncio.Event(), asyncio.Event()

    async def ready(self) -> None:
        """Parent: be ready, and wait for `begin`."""
        self.role_ready.set()
        await self.begin.wait()

    async def gone(self) -> None:
        """Parent: wait for the end."""
        await self.end.wait()


async def _play(
    parent: Parent,
    first: Callable[[Any], Awaitable[dict[str, float]]],
    second: Callable[[Any], Awaitable[Any]],
) -> tuple[Load, dict[str, float], dict[str, float]]:
    """Play both roles; the first must be ready before the second starts, and ends last."""
    parents = RoleParent(), RoleParent()
    async with asyncio.TaskGroup() as group:
        tasks: list[asyncio.Future[dict[str, float]]] = []
        for play, each in zip((first, second), parents, strict=True):
            tasks.append(group.create_task(_run(play, each)))
            await each.role_ready.wait()
        await parent.ready()
        load = Load()
        for each in parents:
            each.begin.set()
        figures = await tasks[1]
        parents[0].end.set()
        return load, await tasks[0], figures


async def _run(play: Callable[[Any], Awaitable[dict[str, float]]], parent: RoleParent) -> dict[str, float]:
    try:
        return await play(parent)
    finally:
        parent.role_ready.set()  # one that fails is waited for no longer


async def stream_together(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Publish and subscribe as `stream.publisher` and `stream.subscriber` do."""
    load, received, sent = await _play(
        parent,
        lambda own: stream.subscriber({**parameters, "subscriptions": 1}, own),
        lambda own: stream.publisher({**parameters, "readers": 1}, own),
    )
    return {**received, **load.figures(int(received["received"])), "sent": sent["sent"]}


async def calls_together(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Serve and call as `requests.server` and `requests.requester` do."""
    load, _, called = await _play(
        parent,
        lambda own: requests.server(parameters, own),
        lambda own: requests.requester(parameters, own),
    )
    return {**called, **load.figures(int(called["calls"]))}
