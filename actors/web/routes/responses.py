"""Responses of the API: JSON, and errors as `{"error": TEXT}`."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Final

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
from actors.web import limits
from actors.web.forms import FormTooLargeError
from actors.web.javascript_values import TooManyValuesError
from actors.web.json_encoding import encode_json
from actors.web.log_reader import TooManyLogReadersError
from actors.web.pieces import pieces
from actors.web.routes.event_stream import STREAM, EventStream
from actors.web.shares import ShareUsedUpError
from actors.web.sign_ins import TokenNotAcceptedError
from actors.web.subscription_answer import SubscriptionRefusedError
from actors.web.topic_feed import TooManyTopicsError
from actors.web.users import NoUsersError, TooManyUsersError
from actors.web.worker import TooMuchWorkError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

_STATUS: Final[tuple[tuple[type[Exception], int], ...]] = (
    (NotAuthorized, 401),
    (PublisherRefused, 403),
    (SubscriptionRefusedError, 403),
    (BrokerUnreachable, 503),
    (ShareUsedUpError, 503),
    (TooManyUsersError, 503),
    (TokenNotAcceptedError, HTTPStatus.TOO_MANY_REQUESTS),
    (TooManyTopicsError, 503),
    (TooManyLogReadersError, 503),
    (TooMuchWorkError, 503),
    (NoUsersError, 503),
    (ServiceUnavailable, 503),
    (ServiceTimeout, 504),
    (WaitTimeout, 504),
    (GoalRejected, 409),
    (RemoteError, 502),
    (TooManyValuesError, 502),
    (FormTooLargeError, 422),
    (msgspec.ValidationError, 400),
    (msgspec.DecodeError, 400),
    (CallboardError, 400),
)
"""The status of the response to each error of a handler; the first class that fits counts."""


class NotFoundError(Exception):
    """The graph has nothing of that name; the text says what."""


def json_response(document: object, status: int = 200) -> web.Response:
    """Return a document as a JSON response. NaN and infinity, which JSON lacks, become null.

    Args:
        document: Maps, lists, texts and numbers.
        status: The HTTP status.
    """
    return encoded_response(encode_json(document), status)


def encoded_response(body: bytes, status: int = 200) -> web.Response:
    """Return a document that has been encoded as a JSON response.

    Args:
        body: The document.
        status: The HTTP status.
    """
    return bytes_response(body, "application/json", status)


def bytes_response(body: bytes, content_type: str, status: int = 200) -> web.Response:
    """Return a response that is sent in pieces, each when the client has read the last one.

    Args:
        body: Its bytes.
        content_type: Their type.
        status: The HTTP status.
    """
    headers = {"Content-Length": str(len(body))}
    return web.Response(body=pieces(body), status=status, headers=headers, content_type=content_type)


def error_response(status: int, reason: str) -> web.Response:
    """Return a response that has only `error`.

    Args:
        status: The HTTP status.
        reason: One line.
    """
    # The library has surrogates for bytes of headers that are not UTF-8, and its errors quote them.
    return json_response({"error": reason.encode(errors="backslashreplace").decode()}, status)


async def respond(
    handler: Callable[[web.Request], Awaitable[web.StreamResponse]], request: web.Request
) -> web.StreamResponse:
    """Return the response of a handler, or that to its error: an event if a stream has begun."""
    try:
        return await handler(request)
    except NotFoundError as error:
        status, reason = 404, str(error)
    except web.HTTPException as error:
        status, reason = error.status, error.text or error.reason
    except (CallboardError, msgspec.MsgspecError) as error:
        status, reason = next(status for kind, status in _STATUS if isinstance(error, kind)), str(error)
    stream: EventStream | None = request.get(STREAM)
    if stream is None:
        response = error_response(status, reason)
        if status == HTTPStatus.TOO_MANY_REQUESTS:
            response.headers["Retry-After"] = str(limits.RETRY_SEC)
        return response
    await stream.send({"error": reason}, "error")
    return stream.response
