"""What the page may do."""

from __future__ import annotations

from typing import Final

from aiohttp import web

from actors.web.routes.answers import answer
from actors.web.routes.state import state_of
from actors.web.security import bearer


async def session(request: web.Request) -> web.Response:
    """Return whether who asks may control anything (`refusal`: why not), and what is needed for reading."""
    state = state_of(request)
    refusal = state.door.refuses_control(bearer(request.headers))
    return answer(
        {
            "control": refusal is None,
            "refusal": None if refusal is None else refusal.reason,
            "token_needed": state.door.private,
            "target": state.observer.target,
        }
    )


ROUTES: Final = (web.get("/api/session", session),)
