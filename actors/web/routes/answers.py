"""Answers of the API: JSON, errors as `{"error": TEXT}`, and streams of events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import msgspec
from aiohttp import web

from actors.errors import (
    BrokerUnreachable,
    GoalRejected,
    NotAuthorized,
    PublisherRefused,
    RemoteError,
    ServiceTimeout,
    ServiceUnavailable,
    WaitTimeout,
)
from actors.web.subscription_answer import SubscriptionRefusedError
from actors.web.users import NoUsersError, TooManyUsersError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

_STATUS: Final[tuple[tuple[type[Exception], int], ...]] = (
    (NotAuthorized, 401),
    (PublisherRefused, 403),
    (SubscriptionRefusedError, 403),
    (BrokerUnreachable, 503),
    (TooManyUsersError, 503),
    (NoUsersError, 503),
    (ServiceUnavailable, 503),
    (ServiceTimeout, 504),
    (WaitTimeout, 504),
    (GoalRejected, 409),
    (RemoteError, 502),
    (msgspec.ValidationError, 400),
    (msgspec.DecodeError, 400),
    (CallboardError, 400),
)
"""The status of an answer when a handler raises; the first that fits."""


class UnknownError(Exception):
    """The graph has nothing of that name; the text says what."""


def answer(document: object, status: int = 200) -> web.Response:
    """Return a JSON answer. NaN and infinity, which JSON lacks, become null.

    Args:
        document: Maps, lists, texts and numbers.
        status: The HTTP status.
    """
    body = msgspec.json.encode(document)
    return web.Response(body=body, status=status, content_type="application/json")


def failure(status: int, reason: str) -> web.Response:
    """Return an answer that says in `error` why there is no other.

    Args:
        status: The HTTP status.
        reason: One line.
    """
    return answer({"error": reason}, status)


async def answered(
    handler: Callable[[web.Request], Awaitable[web.StreamResponse]], request: web.Request
) -> web.StreamResponse:
    """Return what a handler answers, or what its error says."""
    try:
        return await handler(request)
    except UnknownError as error:
        return failure(404, str(error))
    except web.HTTPException as error:
        return failure(error.status, error.text or error.reason)
    except (CallboardError, msgspec.MsgspecError) as error:
        status = next(status for kind, status in _STATUS if isinstance(error, kind))
        return failure(status, str(error))


async def body_of(request: web.Request) -> dict[str, Any]:
    """Return the body of a request, a JSON object; an empty one if there is none.

    Raises:
        msgspec.DecodeError: It is none.
        web.HTTPRequestEntityTooLarge: It has more than `MAX_BODY_BYTES`.
    """
    return msgspec.json.decode(await request.read() or b"{}", type=dict[str, Any])


async def event_stream(request: web.Request) -> web.StreamResponse:
    """Begin a stream of server-sent events."""
    response = web.StreamResponse(headers={"Content-Type": "text/event-stream", "Cache-Control": "no-store"})
    await response.prepare(request)
    return response


async def send_event(response: web.StreamResponse, document: object, event: str = "message") -> None:
    """Send one event, and wait while the reader is slow.

    Args:
        response: The stream.
        document: Its data, as JSON.
        event: Its kind.
    """
    await response.write(f"event: {event}\ndata: ".encode() + msgspec.json.encode(document) + b"\n\n")
