"""The bodies of requests, decoded."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import msgspec

if TYPE_CHECKING:
    from aiohttp import web

Body = TypeVar("Body", bound=msgspec.Struct)


async def read_body(request: web.Request, kind: type[Body]) -> Body:
    """Return the body of a request, a JSON object; no body is an empty object.

    Args:
        request: The request.
        kind: The class that describes the object.

    Raises:
        msgspec.DecodeError: The body is not JSON, or does not fit the class.
    """
    return msgspec.json.decode(await request.read() or b"{}", type=kind)
