"""The HTTP API as an OpenAPI description, made from the routes: what `GET /api/openapi.json` has."""

from __future__ import annotations

import re
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import msgspec
from aiohttp import web

from actors.web.routes.responses import encoded_response
from actors.web.routes.route import JSON, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

ALL_ROUTES: Final[web.AppKey[tuple[Route, ...]]] = web.AppKey("ALL_ROUTES")
"""The routes of the server: this one cannot import them, as it is one of them."""

ERRORS: Final = {
    "400": "The request is wrong; the text names the field",
    "401": "A token is required",
    "403": "The request comes from another site, the server is read-only, or the rules forbid it",
    "404": "The graph has nothing of that name",
    "408": "The body did not arrive in time",
    "409": "The goal was rejected",
    "413": "The body is too large, or the request must not have one",
    "415": "The body is compressed",
    "421": "The server does not go by the name in the Host header",
    "422": "The newest message has no image that can be shown, or the type is too large for a form",
    "429": "The broker has not accepted the token in time, after several wrong ones: try again later",
    "502": "The node that was asked has failed",
    "503": "There is no broker or no server now, or a limit is reached",
    "504": "The node that was asked has not answered in time",
}
"""The meaning of each status of an error; its body is a JSON object with the text `error`."""


def openapi(routes: Iterable[Route]) -> dict[str, Any]:
    """Return the description of routes, OpenAPI 3.1."""
    routes = list(routes)
    bodies = [each.body for each in routes if each.body is not None]
    references, schemas = msgspec.json.schema_components(bodies, ref_template="#/components/schemas/{name}")
    names = dict(zip(bodies, references, strict=True))
    paths: dict[str, dict[str, Any]] = {}
    for route in routes:
        paths.setdefault(route.path, {})[route.method.lower()] = _described(route, names)
    error = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "callboard web",
            "version": version("callboard"),
            "description": "Read a graph; with --allow-control and the token also control it.",
        },
        "paths": paths,
        "components": {
            "schemas": {**schemas, "Error": error},
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def _described(route: Route, bodies: Mapping[type[msgspec.Struct], Mapping[str, Any]]) -> dict[str, Any]:
    schema = {"type": "string"} if route.content != JSON else {}
    success: dict[str, Any] = {"description": route.summary}
    if route.status == 200:
        success["content"] = {route.content: {"schema": schema}}
    failure = {JSON: {"schema": {"$ref": "#/components/schemas/Error"}}}
    described: dict[str, Any] = {
        "summary": route.summary,
        "parameters": [
            *(
                {"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
                for name in re.findall(r"\{(\w+)\}", route.path)
            ),
            *(
                {"name": name, "in": "query", "description": text, "schema": {"type": "string"}}
                for name, text in (route.query or {}).items()
            ),
        ],
        "responses": {
            str(route.status): success,
            **{code: {"description": ERRORS[code], "content": failure} for code in route.errors},
        },
        # For reading it is needed beyond loopback only.
        "security": [{"token": []}] if route.control else [{}] if route.open else [{}, {"token": []}],
    }
    if route.body is not None:
        described["requestBody"] = {"content": {JSON: {"schema": bodies[route.body]}}}
    return described


async def describe(request: web.Request) -> web.Response:
    """Return the API as an OpenAPI description."""
    routes = request.app[ALL_ROUTES]
    documents = workspace_of(request).documents
    return encoded_response(await documents.encoded("openapi", lambda: (routes,), openapi))


ROUTES: Final = (
    Route(
        "GET",
        "/api/openapi.json",
        describe,
        summary="This description",
    ),
)
