"""The description of the API."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web.openapi import openapi
from actors.web.routes.answers import answer


async def describe(_: web.Request) -> web.Response:
    """Return the API as an OpenAPI description."""
    return answer(openapi())


ROUTES: Final = (web.get("/api/openapi.json", describe),)
