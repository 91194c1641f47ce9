"""Parameters of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import msgspec

from actors.parameter_client.client import ParameterClient
from actors.web.json_encoding import encode_json
from actors.web.node_watch import MAX_PARAMETERS, NODE_ANSWER_SEC, parameters_of
from actors.web.parameter_values import kind_from_name, parameter_from_json
from actors.web.routes.graph import name_in
from actors.web.routes.request_body import read_body
from actors.web.routes.responses import NotFoundError, encoded_response, json_response
from actors.web.routes.route import ASKING, CONTROL, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from aiohttp import web

    from actors.parameters.types import Parameter, ParameterType

MAX_NODE_TIMEOUT_SEC: Final = 600.0
"""The longest timeout that a request may give for parameters or a transition."""

NodeTimeoutSec = Annotated[float, msgspec.Meta(gt=0, le=MAX_NODE_TIMEOUT_SEC)]


class ParameterSetting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A new value for a parameter.

    Attributes:
        name: The parameter's name.
        value: See `parameter_from_json`.
        type: Such as "double"; None for that which the parameter has.
    """

    name: str
    value: Any
    type: str | None = None


class ParametersBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a request to set parameters.

    Attributes:
        parameters: The values.
        atomic: Set all of them, or none.
        timeout_sec: For the node's answer.
    """

    parameters: Annotated[list[ParameterSetting], msgspec.Meta(max_length=MAX_PARAMETERS)]
    atomic: bool = False
    timeout_sec: NodeTimeoutSec = 5.0


def node_in(request: web.Request) -> str:
    """Return the full name in a request's path.

    Raises:
        NotFoundError: There is no such node.
    """
    name = name_in(request)
    if name not in workspace_of(request).observer.around(name).nodes():
        raise NotFoundError(f"There is no node {name!r}")
    return name


async def read(request: web.Request) -> web.Response:
    """Return the parameters with their values and descriptions."""
    name = node_in(request)
    observer = workspace_of(request).observer
    found, omitted = await parameters_of(observer, name, NODE_ANSWER_SEC)
    document = {"parameters": found, "omitted": omitted}
    return encoded_response(await observer.work.run(encode_json, document))


async def change(request: web.Request) -> web.Response:
    """Set parameters one by one, or atomically; return for each, or for all, whether it was set."""
    name = node_in(request)
    body = read_body(request, ParametersBody)
    observer = workspace_of(request).observer
    client = ParameterClient(observer.node, name)
    try:
        untyped = [each.name for each in body.parameters if each.type is None]
        kinds = {each.name: kind_from_name(each.type) for each in body.parameters if each.type is not None}
        if untyped:
            known = await client.get_parameter_types(untyped, body.timeout_sec)
            kinds = {**dict(zip(untyped, known, strict=True)), **kinds}
        wanted = await observer.work.run(_converted, body.parameters, kinds)
        if body.atomic:
            result = await client.set_parameters_atomically(wanted, body.timeout_sec)
            return json_response({"successful": result.successful, "reason": result.reason})
        results = await client.set_parameters(wanted, body.timeout_sec)
    finally:
        client.destroy()
    return json_response(
        [
            {"name": each.name, "successful": result.successful, "reason": result.reason}
            for each, result in zip(wanted, results, strict=True)
        ]
    )


def _converted(
    settings: list[ParameterSetting], kinds: Mapping[str, ParameterType | None]
) -> list[Parameter]:
    return [parameter_from_json(each.name, kinds[each.name], each.value) for each in settings]


PATH: Final = "/api/nodes/{name:.+}/parameters"

ROUTES: Final = (
    Route(
        "GET",
        PATH,
        read,
        summary="The parameters of a node with their values and descriptions",
        errors=("404", "502", *ASKING),
    ),
    Route(
        "PATCH",
        PATH,
        change,
        summary="Set parameters of a node",
        body=ParametersBody,
        errors=(*CONTROL, "404"),
        control=True,
    ),
)
