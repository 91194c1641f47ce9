"""Goals of actions: the form, a stream of what becomes of a goal, and its cancellation."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.tools import graph_documents as documents
from actors.web.javascript_values import message_to_javascript
from actors.web.json_encoding import encode_json
from actors.web.live.session import UPDATE_PERIOD_SEC
from actors.web.routes.calls import CallTimeoutSec, form_response
from actors.web.routes.event_stream import EventStream
from actors.web.routes.graph import name_in
from actors.web.routes.request_body import read_body
from actors.web.routes.responses import NotFoundError, error_response, json_response
from actors.web.routes.route import ASKING, CONTROL, EVENTS, TYPE_QUERY, Route
from actors.web.routes.state import state_of, workspace_of

if TYPE_CHECKING:
    from aiohttp import web

    from actors.actions.client_goal import GoalResult
    from actors.interfaces.message import Message
    from actors.web.goals import FollowedGoal
    from actors.web.worker import WorkShare


class GoalBody(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body of a goal.

    Attributes:
        goal: The fields of the goal; others have their defaults.
        type: The action's type, needed if the graph has several.
        timeout_sec: For the server's answer; null is the node's default.
        cancel_on_close: Whether the goal is cancelled when the stream is closed before its end.
    """

    goal: dict[str, Any] = {}
    type: str = ""
    timeout_sec: CallTimeoutSec | None = None
    cancel_on_close: bool = False


async def action_form(request: web.Request) -> web.Response:
    """Return the form for an action's goals."""
    workspace, name = workspace_of(request), name_in(request)
    part = workspace.observer.around(name)
    if documents.action(part, name) is None:
        raise NotFoundError(f"There is no action {name!r}")
    found: Any = await workspace.types.action(part, name, request.query.get("type", ""))
    return await form_response(workspace, found, found.Goal)


async def goals(request: web.Request) -> web.Response:
    """Return the goals that this server has sent and that have not ended."""
    return json_response(
        [goal.document() for goal in workspace_of(request).goals.of_action(name_in(request))]
    )


async def send_goal(request: web.Request) -> web.StreamResponse:
    """Send a goal, and what becomes of it as events: accepted, feedback, skipped, and result or error."""
    body = read_body(request, GoalBody)
    workspace = workspace_of(request)
    with state_of(request).live_connection(request):
        goal = await workspace.goals.send(name_in(request), body.goal, body.type, body.timeout_sec)
        try:
            await goal.accepted()
            stream = await EventStream.begin(request)
            await stream.send({"goal_id": goal.goal_id}, "accepted")
            await _send_progress(stream, goal, workspace.work)
        finally:
            goal.read = False
            if body.cancel_on_close and not goal.ended:
                workspace.goals.cancel_later(goal)
    return stream.response


async def _send_progress(stream: EventStream, goal: FollowedGoal, work: WorkShare) -> None:
    """Send feedback, of which a slow reader gets the newest, and the end."""
    ended = False
    while not ended:
        await stream.wait(goal.news)
        ended = goal.ended  # before the feedback is taken: nothing comes after the end
        skipped, goal.skipped = goal.skipped, 0
        if skipped:
            await stream.send({"skipped": skipped}, "skipped")
        for each in goal.pop_feedback():
            await stream.send_json(await work.run(_encoded_feedback, each), "feedback")
        if not ended:
            await asyncio.sleep(UPDATE_PERIOD_SEC)
    if goal.outcome is None:
        await stream.send({"error": str(goal.error)}, "error")
    else:
        await stream.send_json(await work.run(_encoded_result, goal.outcome), "result")


def _encoded_feedback(message: Message) -> bytes:
    return encode_json({"feedback": message_to_javascript(message)})


def _encoded_result(outcome: GoalResult[Any]) -> bytes:
    return encode_json({"status": outcome.status.name, "result": message_to_javascript(outcome.result)})


async def cancel(request: web.Request) -> web.Response:
    """Request to cancel a goal that this server has sent."""
    followed, name, goal_id = workspace_of(request).goals, name_in(request), request.match_info["goal"]
    goal = followed.find(name, goal_id)
    if goal is None:
        raise NotFoundError(f"Action {name!r} has no goal {goal_id!r} from here that has not ended")
    if not await followed.cancel(goal):
        return error_response(409, "The server refuses to cancel the goal")
    return json_response({"goal_id": goal_id, "canceling": True})


ROUTES: Final = (
    Route(
        "GET",
        "/api/actions/{name:.+}/form",
        action_form,
        summary="The fields of an action's goals",
        errors=("400", "404", "422", *ASKING),
        query=TYPE_QUERY,
    ),
    Route(
        "GET",
        "/api/actions/{name:.+}/goals",
        goals,
        summary="The goals that this server has sent and that have not ended",
    ),
    Route(
        "DELETE",
        "/api/actions/{name:.+}/goals/{goal:[^/]+}",
        cancel,
        summary="Cancel a goal that this server has sent",
        errors=(*CONTROL, "404"),
        control=True,
    ),
    Route(
        "POST",
        "/api/actions/{name:.+}",
        send_goal,
        summary="Send a goal; its acceptance, feedback and result as events",
        body=GoalBody,
        content=EVENTS,
        errors=(*CONTROL, "409"),
        control=True,
    ),
)
