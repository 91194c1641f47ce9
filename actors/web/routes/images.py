"""The newest image of a topic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import msgspec
from aiohttp import web

from actors.tools import graph_documents as documents
from actors.web.image_files import ImageError
from actors.web.images import IMAGE_TYPES
from actors.web.routes.graph import name_in
from actors.web.routes.responses import NotFoundError, bytes_response, error_response
from actors.web.routes.route import IMAGE, READING, Route
from actors.web.routes.state import state_of, workspace_of

if TYPE_CHECKING:
    from actors.web.images import Image


async def image(request: web.Request) -> web.Response:
    """Return the newest image of a topic, once there is another one than that of the number `after`."""
    workspace, name = workspace_of(request), name_in(request)
    after = msgspec.convert(request.query.get("after", "0"), int, strict=False)
    found = documents.topic(workspace.observer.around(name), name)
    if found is None:
        raise NotFoundError(f"There is no topic {name!r}")
    if IMAGE_TYPES.isdisjoint(found["types"]):
        return error_response(400, f"{name!r} has no images; those are {' or '.join(sorted(IMAGE_TYPES))}")
    with state_of(request).live_connection(request):
        newest = await workspace.images.newest(name, after)
        response = web.Response(status=204) if newest is None else _response(newest)
        await response.prepare(request)
        await response.write_eof()  # here, so that it counts until the client has read it
    return response


def _response(newest: Image) -> web.Response:
    file = newest.found
    if isinstance(file, ImageError):
        response = error_response(422, str(file))
    else:
        response = bytes_response(file.body, file.content_type)
        response.headers["Image-Size"] = f"{file.width}x{file.height}"
        response.headers["Image-Encoding"] = file.encoding
        response.headers["Cache-Control"] = "no-store"
    response.headers["Image-Number"] = str(newest.number)
    response.headers["Image-Sent-Ns"] = str(newest.sent_ns)
    return response


ROUTES: Final = (
    Route(
        "GET",
        "/api/topics/{name:.+}/image",
        image,
        summary="The newest image of a topic; 204 if none comes within 10 s",
        content=IMAGE,
        errors=("400", *READING, "404", "422"),
        query={"after": "The Image-Number of the image that is there: wait for another one"},
    ),
)
