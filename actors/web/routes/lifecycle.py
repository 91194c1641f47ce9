"""Nodes with states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.web.node_watch import NODE_ANSWER_SEC, lifecycle_of
from actors.web.routes.parameters import NodeTimeoutSec, node_in
from actors.web.routes.request_body import read_body
from actors.web.routes.responses import error_response, json_response
from actors.web.routes.route import ASKING, CONTROL, Route
from actors.web.routes.state import workspace_of

if TYPE_CHECKING:
    from aiohttp import web


class TransitionBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a request for a transition.

    Attributes:
        transition: Its label, such as "configure", or its number.
        timeout_sec: For the node's callback: it may start hardware.
    """

    transition: str | int
    timeout_sec: NodeTimeoutSec = 60.0


async def read(request: web.Request) -> web.Response:
    """Return the state, and the transitions from it."""
    return json_response(
        await lifecycle_of(workspace_of(request).observer.node, node_in(request), NODE_ANSWER_SEC)
    )


async def change(request: web.Request) -> web.Response:
    """Request a transition, wait for its end, and return whether it succeeded, and the state."""
    node, name = workspace_of(request).observer.node, node_in(request)
    body = read_body(request, TransitionBody)
    available: list[dict[str, Any]] = (await lifecycle_of(node, name, NODE_ANSWER_SEC))["transitions"]
    chosen = next((each for each in available if body.transition in {each["label"], each["id"]}), None)
    if chosen is None:
        known = ", ".join(str(each["label"]) for each in available) or "none"
        return error_response(400, f"There is no such transition from the current state; there is {known}")
    client = node.create_client(ChangeState, f"{name}/change_state")
    try:
        transition = Transition(id=chosen["id"], label=chosen["label"])
        response = await client.call(ChangeState.Request(transition=transition), body.timeout_sec)
    finally:
        client.destroy()
    after = await lifecycle_of(node, name, NODE_ANSWER_SEC)
    return json_response({"success": response.success, **after})


PATH: Final = "/api/nodes/{name:.+}/lifecycle"

ROUTES: Final = (
    Route(
        "GET",
        PATH,
        read,
        summary="The state of a node, and the transitions from it",
        errors=("404", "502", *ASKING),
    ),
    Route(
        "POST",
        PATH,
        change,
        summary="Request a transition of a node",
        body=TransitionBody,
        errors=(*CONTROL, "404"),
        control=True,
    ),
)
