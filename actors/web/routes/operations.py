"""Metrics, and probes of the server and the broker, for operators."""

from __future__ import annotations

import asyncio
import time
from typing import Final

from aiohttp import web
from prometheus_client import CONTENT_TYPE_LATEST

from actors.errors import BrokerUnreachable
from actors.web.probes import BROKER_ANSWER_SEC, broker_answers
from actors.web.routes.responses import json_response
from actors.web.routes.route import TEXT, Route
from actors.web.routes.state import state_of, workspace_of


async def metrics(request: web.Request) -> web.Response:
    """Return numbers for Prometheus; `callboard_up` is 0 if the broker does not answer."""
    workspace = workspace_of(request)
    workspace.round_trips.begin()
    try:
        async with asyncio.timeout(BROKER_ANSWER_SEC):
            report = await workspace.observer.broker_report()
    except (BrokerUnreachable, TimeoutError):
        report = None
    snapshot = workspace.observer.snapshot
    text = await workspace.work.run(workspace.metrics.text, report, snapshot, time.monotonic())
    text += state_of(request).listener.refusals.text()
    return web.Response(body=text, headers={"Content-Type": CONTENT_TYPE_LATEST, "Cache-Control": "no-store"})


async def healthz(_: web.Request) -> web.Response:
    """Return that the server lives."""
    return json_response({"status": "ok"})


async def readyz(request: web.Request) -> web.Response:
    """Return whether the broker answers within a second; 503 if not."""
    if await broker_answers(workspace_of(request).observer.node):
        return json_response({"status": "ok"})
    return json_response({"status": "unavailable", "error": "The broker does not answer"}, 503)


ROUTES: Final = (
    Route(
        "GET",
        "/metrics",
        metrics,
        summary="The broker's numbers for Prometheus",
        content=TEXT,
    ),
    Route(
        "GET",
        "/healthz",
        healthz,
        summary="The server lives",
        errors=(),
        open=True,
    ),
    Route(
        "GET",
        "/readyz",
        readyz,
        summary="The broker answers within a second",
        errors=("503",),
        open=True,
    ),
)
