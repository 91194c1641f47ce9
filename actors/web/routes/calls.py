"""Calls of services, messages for topics, and the forms for both."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final

import msgspec

from actors.interfaces.message import type_name
from actors.tools import graph_documents as documents
from actors.web.forms import form_of
from actors.web.json_encoding import encode_json
from actors.web.routes.graph import name_in
from actors.web.routes.request_body import read_body
from actors.web.routes.responses import NotFoundError, encoded_response, json_response
from actors.web.routes.route import ASKING, CONTROL, TYPE_QUERY, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from aiohttp import web

    from actors.interfaces.message import Message
    from actors.web.workspace import Workspace

MAX_CALL_TIMEOUT_SEC: Final = 3600.0
"""The longest timeout that a request may give for a call or a goal."""

CallTimeoutSec = Annotated[float, msgspec.Meta(gt=0, le=MAX_CALL_TIMEOUT_SEC)]


class CallBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a call.

    Attributes:
        request: The fields of the request; others have their defaults.
        type: The service's type, needed if the graph has several.
        timeout_sec: For the reply; null is the node's default.
    """

    request: dict[str, Any] = {}
    type: str = ""
    timeout_sec: CallTimeoutSec | None = None


class PublishBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a message for a topic.

    Attributes:
        message: The fields of the message; others have their defaults.
        type: The topic's type, needed if the graph has none or several.
    """

    message: dict[str, Any] = {}
    type: str = ""


async def service_form(request: web.Request) -> web.Response:
    """Return the form for a service's requests."""
    workspace, name = workspace_of(request), name_in(request)
    part = workspace.observer.around(name)
    if documents.service(part, name) is None:
        raise NotFoundError(f"There is no service {name!r}")
    found: Any = await workspace.types.service(part, name, request.query.get("type", ""))
    return await form_response(workspace, found, found.Request)


async def topic_form(request: web.Request) -> web.Response:
    """Return the form for a topic's messages."""
    workspace, name = workspace_of(request), name_in(request)
    part = workspace.observer.around(name)
    found = await workspace.types.message(part, name, request.query.get("type", ""))
    return await form_response(workspace, found, found)


async def form_response(workspace: Workspace, interface: type[Any], sent: type[Message]) -> web.Response:
    """Return the form for what is sent to a topic, service or action.

    Args:
        workspace: The user's.
        interface: The type of the topic, service or action.
        sent: The type of what is sent.
    """
    made = partial(_encoded_form, type_name(interface), sent)
    return encoded_response(await workspace.work.run(made))


def _encoded_form(name: str, sent: type[Message]) -> bytes:
    return encode_json({"type": name, "form": form_of(sent)})


async def call(request: web.Request) -> web.Response:
    """Call a service once; the call is cancelled if who asked leaves."""
    body = read_body(request, CallBody)
    calls = workspace_of(request).calls
    response = await calls.call(name_in(request), body.request, body.type, body.timeout_sec)
    encoded = await workspace_of(request).work.run(encode_json, {"response": response})
    return encoded_response(encoded)


async def publish(request: web.Request) -> web.Response:
    """Publish one message."""
    body = read_body(request, PublishBody)
    matched = await workspace_of(request).calls.publish(name_in(request), body.message, body.type)
    return json_response({"subscriptions": matched})


ROUTES: Final = (
    Route(
        "GET",
        "/api/services/{name:.+}/form",
        service_form,
        summary="The fields of a service's requests",
        errors=("400", "404", "422", *ASKING),
        query=TYPE_QUERY,
    ),
    Route(
        "GET",
        "/api/topics/{name:.+}/form",
        topic_form,
        summary="The fields of a topic's messages",
        errors=("400", "422", *ASKING),
        query=TYPE_QUERY,
    ),
    Route(
        "POST",
        "/api/services/{name:.+}",
        call,
        summary="Call a service",
        body=CallBody,
        errors=CONTROL,
        control=True,
    ),
    Route(
        "POST",
        "/api/topics/{name:.+}",
        publish,
        summary="Publish one message",
        body=PublishBody,
        errors=CONTROL,
        control=True,
    ),
)
