"""The bodies of requests: received within limits, and decoded.

A body is read only if its request may have one, and after everything in the headers has been checked. It is
never decompressed: a few bytes could become many.
"""

from __future__ import annotations

import asyncio
from typing import Final, TypeVar

import msgspec
from aiohttp import HttpVersion11, web

from actors.web.json_decoding import decode_json

Body = TypeVar("Body", bound=msgspec.Struct)

_BODY: Final = web.RequestKey("BODY", bytes)


def check_headers(request: web.Request) -> None:
    """Refuse a body in a form that is not read.

    Raises:
        web.HTTPUnsupportedMediaType: It is compressed.
    """
    encoding = request.headers.get("Content-Encoding", "identity")
    if encoding.lower() != "identity":
        raise web.HTTPUnsupportedMediaType(text="Send the body of the request without Content-Encoding")


def refuse_body(request: web.Request) -> None:
    """Refuse a request that has a body, because nothing would read it.

    Raises:
        web.HTTPRequestEntityTooLarge: It has one.
    """
    if request.body_exists and request.content_length != 0:
        raise web.HTTPRequestEntityTooLarge(0, 0, text="A request of this kind has no body")


async def receive_body(request: web.Request, *, most: int, seconds: float) -> None:
    """Receive the body of a request, for `read_body`.

    Args:
        request: The request.
        most: Its bytes at most.
        seconds: The time for all of it to arrive.

    Raises:
        web.HTTPRequestEntityTooLarge: It has more, by its headers or in fact.
        web.HTTPRequestTimeout: It does not arrive in time.
    """
    too_large = web.HTTPRequestEntityTooLarge(
        most, most, text=f"The body of the request has more than {most} bytes"
    )
    if (request.content_length or 0) > most:
        raise too_large
    if request.version == HttpVersion11 and request.headers.get("Expect", "").lower() == "100-continue":
        await request.writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        request.writer.output_size = 0  # the answer has not begun
    chunks, size = list[bytes](), 0
    try:
        async with asyncio.timeout(seconds):
            async for chunk in request.content.iter_any():
                size += len(chunk)
                if size > most:
                    raise too_large
                chunks.append(chunk)
    except TimeoutError:
        text = f"The body of the request did not arrive within {seconds:g} s"
        raise web.HTTPRequestTimeout(text=text) from None
    request[_BODY] = b"".join(chunks)


async def expect_nothing(_: web.Request) -> None:
    """Answer `Expect: 100-continue` not yet: `receive_body` asks for the body, if it is wanted."""


def read_body(request: web.Request, kind: type[Body]) -> Body:
    """Return the body of a request, a JSON object; no body is an empty object.

    Args:
        request: The request, whose body has been received.
        kind: The class that describes the object.

    Raises:
        msgspec.DecodeError: The body is not JSON, or does not fit the class.
    """
    return decode_json(request[_BODY] or b"{}", kind)
