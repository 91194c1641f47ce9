"""The HTTP API as an OpenAPI description: what `GET /api/openapi.json` answers. No I/O.

`OPERATIONS` has an entry for each route; a test compares both.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.web.routes.calls import CallBody, PublishBody
from actors.web.routes.goals import GoalBody
from actors.web.routes.lifecycle import TransitionBody
from actors.web.routes.parameters import ParametersBody
from actors.web.routes.session import SignInBody

if TYPE_CHECKING:
    from collections.abc import Mapping

JSON: Final = "application/json"
EVENTS: Final = "text/event-stream"
TEXT: Final = "text/plain"
IMAGE: Final = "image/*"

ERRORS: Final = {
    "400": "The request is wrong; the text names the field",
    "401": "A token is required",
    "403": "The request comes from another site, the server is read-only, or the rules forbid it",
    "404": "The graph has nothing of that name",
    "408": "The body did not arrive in time",
    "409": "The goal was rejected",
    "413": "The body is too large",
    "421": "The server does not go by the name in the Host header",
    "422": "The newest message has no image that can be shown",
    "502": "The node that was asked has failed",
    "503": "There is no broker or no server now, or a limit is reached",
    "504": "The node that was asked has not answered in time",
}
"""The meaning of each status of an error; its body is a JSON object with the text `error`."""

READING: Final = ("401", "403", "421", "503")
ASKING: Final = (*READING, "504")
CONTROL: Final = ("400", *READING, "408", "413", "502", "504")


@dataclass(frozen=True, kw_only=True, slots=True)
class Operation:
    """One method of one path.

    Attributes:
        summary: One line.
        body: Of the request; None for none.
        content: The type of the answer.
        errors: Keys of `ERRORS`.
        query: Parameters behind the path, with one line each.
        control: Whether it needs --allow-control and the token in the Authorization header.
        open: Whether it needs no token, also beyond loopback.
        status: Of an answer that is no error.
    """

    summary: str
    body: type[msgspec.Struct] | None = None
    content: str = JSON
    errors: tuple[str, ...] = READING
    query: Mapping[str, str] | None = None
    control: bool = False
    open: bool = False
    status: int = 200


TYPE_QUERY: Final = {"type": "The type, needed if the graph has several"}
LOG_QUERY: Final = {"level": "The least level", "node": "A node's name", "text": "Part of the line"}

OPERATIONS: Final[dict[tuple[str, str], Operation]] = {
    ("GET", "/api/openapi.json"): Operation(summary="This description"),
    ("GET", "/api/session"): Operation(summary="Whether the caller may control anything, and the broker"),
    ("POST", "/api/session"): Operation(
        summary="Exchange the token for a cookie that grants reading",
        body=SignInBody,
        errors=("400", *READING, "408", "413"),
        open=True,
    ),
    ("DELETE", "/api/session"): Operation(summary="Take that cookie away", errors=("403", "421"), open=True),
    ("GET", "/api/graph"): Operation(summary="The graph as it is drawn: nodes and edges"),
    ("GET", "/api/overview"): Operation(
        summary="Topics, nodes and services with rates, queues and losses", errors=ASKING
    ),
    ("GET", "/api/topics"): Operation(summary="The topics with their types"),
    ("GET", "/api/topics/{name}"): Operation(
        summary="One topic with its endpoints and QoS", errors=(*READING, "404")
    ),
    ("GET", "/api/topics/{name}/echo"): Operation(
        summary="The messages of a topic as events; a slow reader gets the newest",
        content=EVENTS,
        errors=("400", *READING),
        query={"type": "One type's messages only, if the topic has several"},
    ),
    ("GET", "/api/topics/{name}/image"): Operation(
        summary="The newest image of a topic; 204 if none comes within 10 s",
        content=IMAGE,
        errors=("400", *READING, "404", "422"),
        query={"after": "The Image-Number of the image that is there: wait for another one"},
    ),
    ("GET", "/api/topics/{name}/form"): Operation(
        summary="The fields of a topic's messages", errors=("400", *ASKING), query=TYPE_QUERY
    ),
    ("POST", "/api/topics/{name}"): Operation(
        summary="Publish one message", body=PublishBody, errors=CONTROL, control=True
    ),
    ("GET", "/api/services"): Operation(summary="The services with their types"),
    ("GET", "/api/services/{name}"): Operation(summary="One service", errors=(*READING, "404")),
    ("GET", "/api/services/{name}/form"): Operation(
        summary="The fields of a service's requests", errors=("400", "404", *ASKING), query=TYPE_QUERY
    ),
    ("POST", "/api/services/{name}"): Operation(
        summary="Call a service", body=CallBody, errors=CONTROL, control=True
    ),
    ("GET", "/api/actions"): Operation(summary="The actions with their types"),
    ("GET", "/api/actions/{name}"): Operation(summary="One action", errors=(*READING, "404")),
    ("GET", "/api/actions/{name}/form"): Operation(
        summary="The fields of an action's goals", errors=("400", "404", *ASKING), query=TYPE_QUERY
    ),
    ("GET", "/api/actions/{name}/goals"): Operation(
        summary="The goals that this server has sent and that have not ended"
    ),
    ("POST", "/api/actions/{name}"): Operation(
        summary="Send a goal; its acceptance, feedback and result as events",
        body=GoalBody,
        content=EVENTS,
        errors=(*CONTROL, "409"),
        control=True,
    ),
    ("DELETE", "/api/actions/{name}/goals/{goal}"): Operation(
        summary="Cancel a goal that this server has sent", errors=(*CONTROL, "404"), control=True
    ),
    ("GET", "/api/nodes"): Operation(summary="The nodes"),
    ("GET", "/api/nodes/{name}"): Operation(summary="One node with its endpoints", errors=(*READING, "404")),
    ("GET", "/api/nodes/{name}/parameters"): Operation(
        summary="The parameters of a node with their values and descriptions", errors=("404", "502", *ASKING)
    ),
    ("PATCH", "/api/nodes/{name}/parameters"): Operation(
        summary="Set parameters of a node", body=ParametersBody, errors=(*CONTROL, "404"), control=True
    ),
    ("GET", "/api/nodes/{name}/lifecycle"): Operation(
        summary="The state of a node, and the transitions from it", errors=("404", "502", *ASKING)
    ),
    ("POST", "/api/nodes/{name}/lifecycle"): Operation(
        summary="Request a transition of a node",
        body=TransitionBody,
        errors=(*CONTROL, "404"),
        control=True,
    ),
    ("GET", "/api/log"): Operation(
        summary="The lines that are kept and new ones as events",
        content=EVENTS,
        errors=("400", *READING),
        query=LOG_QUERY,
    ),
    ("GET", "/api/live"): Operation(summary="The WebSocket of the page; its messages may change", status=101),
    ("GET", "/metrics"): Operation(summary="The broker's numbers for Prometheus", content=TEXT),
    ("GET", "/healthz"): Operation(summary="The server lives", errors=(), open=True),
    ("GET", "/readyz"): Operation(summary="The broker answers within a second", errors=("503",), open=True),
}
"""By the method and the path, in which a name is percent-encoded or has its slashes as they are."""


def openapi() -> dict[str, Any]:
    """Return the description, OpenAPI 3.1."""
    bodies = [each.body for each in OPERATIONS.values() if each.body is not None]
    references, schemas = msgspec.json.schema_components(bodies, ref_template="#/components/schemas/{name}")
    names = dict(zip(bodies, references, strict=True))
    paths: dict[str, dict[str, Any]] = {}
    for (method, path), operation in OPERATIONS.items():
        found = paths.setdefault(path, {})
        found[method.lower()] = _described(path, operation, names)
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


def _described(
    path: str, operation: Operation, bodies: Mapping[type[msgspec.Struct], Mapping[str, Any]]
) -> dict[str, Any]:
    schema = {"type": "string"} if operation.content != JSON else {}
    success: dict[str, Any] = {"description": operation.summary}
    if operation.status == 200:
        success["content"] = {operation.content: {"schema": schema}}
    failure = {JSON: {"schema": {"$ref": "#/components/schemas/Error"}}}
    described: dict[str, Any] = {
        "summary": operation.summary,
        "parameters": [
            *(
                {"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
                for name in re.findall(r"\{(\w+)\}", path)
            ),
            *(
                {"name": name, "in": "query", "description": text, "schema": {"type": "string"}}
                for name, text in (operation.query or {}).items()
            ),
        ],
        "responses": {
            str(operation.status): success,
            **{code: {"description": ERRORS[code], "content": failure} for code in operation.errors},
        },
        # For reading it is needed beyond loopback only.
        "security": [{"token": []}] if operation.control else [{}] if operation.open else [{}, {"token": []}],
    }
    if operation.body is not None:
        described["requestBody"] = {"content": {JSON: {"schema": bodies[operation.body]}}}
    return described
