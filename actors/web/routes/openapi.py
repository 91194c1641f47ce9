"""The description of the API."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web.openapi import openapi
from actors.web.routes.responses import json_response


async def describe(_: web.Request) -> web.Response:
    """Return the API as an OpenAPI description."""
    return json_response(openapi())


ROUTES: Final = (web.get("/api/openapi.json", describe),)
