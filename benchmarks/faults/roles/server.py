"""A server that never answers: reports when it has declared its service, and when it is called."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.faults.roles.controller import Controller, report

if TYPE_CHECKING:
    from collections.abc import Mapping


async def run(parameters: Mapping[str, Any], controller: Controller) -> None:
    """Serve until the measuring process ends."""

    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        del request
        report("called")
        await asyncio.Event().wait()
        raise AssertionError("nobody sets it")

    async with actors.Node("faults_server", url=parameters["url"]) as node:
        await node.get_graph()  # connected: only the declaration is measured
        declared = time.monotonic()
        node.create_service(AddTwoInts, parameters["service"], add)
        report("declared", at=declared)
        await controller.next_command()
