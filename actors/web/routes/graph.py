"""The graph: the same documents as the command line's `--json` (docs/reference/json.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools import graph_documents as documents
from actors.tools.graph_drawing.model import document_of, model_of
from actors.web.json_encoding import encode_json
from actors.web.routes.responses import NotFoundError, encoded_response
from actors.web.routes.route import ASKING, READING, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from aiohttp import web

    from actors.graph.snapshot import GraphSnapshot
    from actors.web.observer import Observer


def name_in(request: web.Request) -> str:
    """Return the full name in a request's path; its first slash may be left out."""
    name = request.match_info["name"]
    return name if name.startswith("/") else f"/{name}"


async def graph(request: web.Request) -> web.Response:
    """Return the graph as it is drawn."""
    return await _whole(
        request,
        "graph",
        lambda observer, snapshot: document_of(model_of(snapshot, brokers=observer.brokers_of_nodes())),
    )


async def overview(request: web.Request) -> web.Response:
    """Return topics, nodes and services with their rates, as of the last two samples."""
    workspace = workspace_of(request)
    seen = await workspace.observer.sample()
    return encoded_response(await workspace.documents.encoded("overview", (seen,), seen.as_dict))


async def topics(request: web.Request) -> web.Response:
    """Return the topics with their types."""
    return await _whole(request, "topics", lambda _, snapshot: documents.topics(snapshot))


async def services(request: web.Request) -> web.Response:
    """Return the services with their types."""
    return await _whole(request, "services", lambda _, snapshot: documents.services(snapshot))


async def actions(request: web.Request) -> web.Response:
    """Return the actions with their types."""
    return await _whole(request, "actions", lambda _, snapshot: documents.actions(snapshot))


async def nodes(request: web.Request) -> web.Response:
    """Return the nodes."""
    return await _whole(
        request, "nodes", lambda observer, snapshot: documents.nodes(snapshot, observer.broker_names())
    )


async def _whole(
    request: web.Request, name: str, make: Callable[[Observer, GraphSnapshot], object]
) -> web.Response:
    """Return a document of the whole graph, which is made once for each state of it."""
    workspace = workspace_of(request)
    observer = workspace.observer
    snapshot = observer.snapshot
    made = await workspace.documents.encoded(
        name, (snapshot, observer.report), lambda: make(observer, snapshot)
    )
    return encoded_response(made)


def _one(find: Callable[..., dict[str, Any] | None], noun: str) -> Callable[[web.Request], Any]:
    async def handler(request: web.Request) -> web.Response:
        workspace, name = workspace_of(request), name_in(request)
        observer = workspace.observer
        part = observer.around(name)

        def made() -> bytes:
            found = find(part, name, observer.broker_names())
            if found is None:
                raise NotFoundError(f"There is no {noun} {name!r}")
            return encode_json(found)

        return encoded_response(await workspace.work.run(made))

    handler.__doc__ = f"Return one {noun}."
    return handler


ROUTES: Final = (
    Route(
        "GET",
        "/api/graph",
        graph,
        summary="The graph as it is drawn: nodes and edges",
    ),
    Route(
        "GET",
        "/api/overview",
        overview,
        summary="Topics, nodes and services with rates, queues and losses",
        errors=ASKING,
    ),
    Route(
        "GET",
        "/api/topics",
        topics,
        summary="The topics with their types",
    ),
    Route(
        "GET",
        "/api/topics/{name:.+}",
        _one(documents.topic, "topic"),
        summary="One topic with its endpoints and QoS",
        errors=(*READING, "404"),
    ),
    Route(
        "GET",
        "/api/services",
        services,
        summary="The services with their types",
    ),
    Route(
        "GET",
        "/api/services/{name:.+}",
        _one(documents.service, "service"),
        summary="One service",
        errors=(*READING, "404"),
    ),
    Route(
        "GET",
        "/api/actions",
        actions,
        summary="The actions with their types",
    ),
    Route(
        "GET",
        "/api/actions/{name:.+}",
        _one(documents.action, "action"),
        summary="One action",
        errors=(*READING, "404"),
    ),
    Route(
        "GET",
        "/api/nodes",
        nodes,
        summary="The nodes",
    ),
    Route(
        "GET",
        "/api/nodes/{name:.+}",
        _one(documents.node, "node"),
        summary="One node with its endpoints",
        errors=(*READING, "404"),
    ),
)
