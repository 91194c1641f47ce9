"""One route: its handler, and what the description of the API says of it."""

from __future__ import annotations

import re
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web.routes.request_body import expect_nothing

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    import msgspec

    Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

JSON: Final = "application/json"
EVENTS: Final = "text/event-stream"
TEXT: Final = "text/plain"
IMAGE: Final = "image/*"

READING: Final = ("401", "403", "413", "415", "421", "429", "503")
ASKING: Final = (*READING, "504")
CONTROL: Final = ("400", *READING, "408", "502", "504")

TYPE_QUERY: Final = {"type": "The type, needed if the graph has several"}


@dataclass(frozen=True, slots=True)
class Route:
    """One method of one path.

    Attributes:
        method: Of HTTP.
        pattern: The path, as aiohttp matches it.
        handler: Answers requests.
        summary: One line.
        body: Of the request; None for none.
        content: The type of the answer.
        errors: Keys of `actors.web.routes.openapi.ERRORS`.
        query: Parameters behind the path, with one line each.
        control: Whether it needs --allow-control and the token in the Authorization header.
        open: Whether it needs no token, also beyond loopback.
        status: Of an answer that is no error.
    """

    method: str
    pattern: str
    handler: Handler
    _: KW_ONLY
    summary: str
    body: type[msgspec.Struct] | None = None
    content: str = JSON
    errors: tuple[str, ...] = READING
    query: Mapping[str, str] | None = None
    control: bool = False
    open: bool = False
    status: int = 200

    @property
    def path(self) -> str:
        """The path, in which a name is percent-encoded or has its slashes as they are."""
        return re.sub(r":[^{}]+\}", "}", self.pattern)

    def definition(self) -> web.RouteDef:
        """Return it for aiohttp. Who may GET a path may ask for its HEAD."""
        if self.method == "GET":
            return web.get(self.pattern, self.handler, expect_handler=expect_nothing)
        return web.route(self.method, self.pattern, self.handler, expect_handler=expect_nothing)
