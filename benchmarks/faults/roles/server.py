"""A server that never answers: says when it has declared its service, and when it is called."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.faults.roles.director import Director, report

if TYPE_CHECKING:
    from collections.abc import Mapping


async def play(parameters: Mapping[str, Any], director: Director) -> None:
    """Serve until the end."""

    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        del request
        report("called")
        await asyncio.Event().wait()
        raise AssertionError("nobody sets it")

    async with actors.Node("faults_server", url=parameters["url"]) as node:
        await node.get_graph()  # the link is up: what is measured is the service's way, not the connection's
        declared = time.monotonic()
        node.create_service(AddTwoInts, parameters["service"], add)
        report("declared", at=declared)
        await director.word()
