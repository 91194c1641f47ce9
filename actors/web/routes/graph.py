"""The graph: the same documents as the command line's `--json` (docs/reference/json.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.tools import graph_documents as documents
from actors.tools.graph_drawing.model import document_of, model_of
from actors.tools.overview import Overview
from actors.web.json_encoding import encode_json
from actors.web.routes.responses import NotFoundError, encoded_response
from actors.web.routes.route import ASKING, READING, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from aiohttp import web

    from actors.graph.snapshot import GraphSnapshot


def name_in(request: web.Request) -> str:
    """Return the full name in a request's path; its first slash may be left out."""
    name = request.match_info["name"]
    return name if name.startswith("/") else f"/{name}"


async def graph(request: web.Request) -> web.Response:
    """Return the graph as it is drawn."""
    observer = workspace_of(request).observer
    return await _whole(
        request,
        "graph",
        lambda snapshot, _: document_of(model_of(snapshot, brokers=observer.brokers_of_nodes())),
    )


async def overview(request: web.Request) -> web.Response:
    """Return topics, nodes and services with their rates, as of the last two samples."""
    workspace = workspace_of(request)
    seen = await workspace.observer.sample()
    made = await workspace.documents.encoded("overview", lambda: (seen,), Overview.as_dict)
    return encoded_response(made)


async def topics(request: web.Request) -> web.Response:
    """Return the topics with their types."""
    return await _whole(request, "topics", lambda snapshot, _: documents.topics(snapshot))


async def services(request: web.Request) -> web.Response:
    """Return the services with their types."""
    return await _whole(request, "services", lambda snapshot, _: documents.services(snapshot))


async def actions(request: web.Request) -> web.Response:
    """Return the actions with their types."""
    return await _whole(request, "actions", lambda snapshot, _: documents.actions(snapshot))


async def nodes(request: web.Request) -> web.Response:
    """Return the nodes."""
    observer = workspace_of(request).observer
    return await _whole(
        request, "nodes", lambda snapshot, _: documents.nodes(snapshot, observer.broker_names())
    )


async def _whole(
    request: web.Request, name: str, make: Callable[[GraphSnapshot, object], object]
) -> web.Response:
    """Return a document of the whole graph, which is made once for each state of it."""
    workspace = workspace_of(request)
    observer = workspace.observer

    def parts() -> tuple[object, ...]:
        # The report has the names of brokers; it is a new one with each sample.
        return observer.snapshot, None if observer.broker_names() is None else observer.report

    return encoded_response(await workspace.documents.encoded(name, parts, make))


def _one(find: Callable[..., dict[str, Any] | None], noun: str) -> Callable[[web.Request], Any]:
    async def handler(request: web.Request) -> web.Response:
        workspace, name = workspace_of(request), name_in(request)
        observer = workspace.observer

        def made() -> bytes:
            found = find(observer.around(name), name, observer.broker_names())
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
