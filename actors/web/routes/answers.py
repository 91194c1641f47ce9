"""Answers of the API: JSON, and errors as `{"error": TEXT}`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

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
from actors.web.log_reader import TooManyLogReadersError
from actors.web.routes.event_stream import STREAM, EventStream
from actors.web.subscription_answer import SubscriptionRefusedError
from actors.web.topic_feed import TooManyTopicsError
from actors.web.users import NoUsersError, TooManyUsersError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

Body = TypeVar("Body", bound=msgspec.Struct)

_STATUS: Final[tuple[tuple[type[Exception], int], ...]] = (
    (NotAuthorized, 401),
    (PublisherRefused, 403),
    (SubscriptionRefusedError, 403),
    (BrokerUnreachable, 503),
    (TooManyUsersError, 503),
    (TooManyTopicsError, 503),
    (TooManyLogReadersError, 503),
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
    """Return what a handler answers, or what its error says; as an event if a stream has begun."""
    try:
        return await handler(request)
    except UnknownError as error:
        status, reason = 404, str(error)
    except web.HTTPException as error:
        status, reason = error.status, error.text or error.reason
    except (CallboardError, msgspec.MsgspecError) as error:
        status, reason = next(status for kind, status in _STATUS if isinstance(error, kind)), str(error)
    stream: EventStream | None = request.get(STREAM)
    if stream is None:
        return failure(status, reason)
    await stream.send({"error": reason}, "error")
    return stream.response


async def read_body(request: web.Request, kind: type[Body]) -> Body:
    """Return the body of a request, a JSON object; no body is an empty object.

    Args:
        request: The request.
        kind: The class that describes the object.

    Raises:
        msgspec.DecodeError: The body is not JSON, or does not fit the class.
    """
    return msgspec.json.decode(await request.read() or b"{}", type=kind)
