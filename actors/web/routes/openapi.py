"""The description of the API."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web.openapi import openapi
from actors.web.routes.responses import json_response
from actors.web.routes.route import Route

ALL_ROUTES: Final[web.AppKey[tuple[Route, ...]]] = web.AppKey("ALL_ROUTES")
"""The routes of the server: this one cannot import them, as it is one of them."""


async def describe(request: web.Request) -> web.Response:
    """Return the API as an OpenAPI description."""
    return json_response(openapi(request.app[ALL_ROUTES]))


ROUTES: Final = (
    Route(
        "GET",
        "/api/openapi.json",
        describe,
        summary="This description",
    ),
)
