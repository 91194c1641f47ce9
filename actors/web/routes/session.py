"""The rights of the page, and the cookie with which it may read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import msgspec

from actors.web.refusals import Refusal
from actors.web.routes.request_body import read_body
from actors.web.routes.responses import error_response, json_response
from actors.web.routes.route import READING, Route
from actors.web.routes.state import CONNECTION, state_of, workspace_of
from actors.web.security import bearer

if TYPE_CHECKING:
    from aiohttp import web

NEED_NO_TOKEN: Final = frozenset({("POST", "/api/session"), ("DELETE", "/api/session")})
"""Need no token beforehand: to sign in, and to sign out."""


class SignInBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a request to sign in.

    Attributes:
        token: That of the address that the server printed, or that of one of the broker's users.
    """

    token: str


async def session(request: web.Request) -> web.Response:
    """Return whether who asks may control anything (`refusal`: why not), and what is needed for reading."""
    state, workspace = state_of(request), workspace_of(request)
    token = bearer(request.headers)
    known = bool(token) and (workspace is not state.own or state.policy.knows_token(token))
    refusal = state.policy.refuses_control(known=known)
    return json_response(
        {
            "control": refusal is None,
            "refusal": None if refusal is None else refusal.reason,
            "token_needed": state.private,
            "target": workspace.observer.target,
            "user": workspace.observer.node.user,
        }
    )


async def sign_in(request: web.Request) -> web.Response:
    """Give a browser the cookie for reading: a WebSocket and an image have no Authorization header."""
    state = state_of(request)
    token = (read_body(request, SignInBody)).token
    if not state.policy.knows_token(token):
        connection = request[CONNECTION]
        if state.users is None:
            state.listener.count(Refusal.TOKENS, connection.source)
            return error_response(401, "That is not the token of this server")
        with connection.waiting():
            async with state.users.workspace(token, connection.address):
                pass  # the broker knows it
    response = json_response({})
    response.set_cookie(
        cookie_name(request), token, httponly=True, samesite="Strict", secure=state.options.tls is not None
    )
    return response


async def sign_out(request: web.Request) -> web.Response:
    """Take the cookie for reading from a browser."""
    response = json_response({})
    response.del_cookie(cookie_name(request), httponly=True, samesite="Strict")
    return response


def cookie_name(request: web.Request) -> str:
    """Return the name of the cookie with the token for reading; browsers share cookies among ports."""
    return f"callboard-{request.url.port}"


ROUTES: Final = (
    Route(
        "GET",
        "/api/session",
        session,
        summary="Whether the caller may control anything, and the broker",
    ),
    Route(
        "POST",
        "/api/session",
        sign_in,
        summary="Exchange the token for a cookie that grants reading",
        body=SignInBody,
        errors=("400", *READING, "408"),
        open=True,
    ),
    Route(
        "DELETE",
        "/api/session",
        sign_out,
        summary="Take that cookie away",
        errors=("403", "413", "415", "421"),
        open=True,
    ),
)
