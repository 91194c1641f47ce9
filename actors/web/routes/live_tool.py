"""Live tools: programs with WebSocket protocols of their own, which the server speaks beside its page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from aiohttp import web


@dataclass(frozen=True, kw_only=True, slots=True)
class LiveTool:
    """The protocol of a live tool.

    A client shows its token in the Authorization header, or as `token` in the query of the address: a browser
    gives a WebSocket no header. The cookie of the page does not count, as it comes from any site's page.

    Attributes:
        name: As in `WebOptions.tools`.
        handler: Answers requests to connect.
        origins: Sites of the tool itself, whose pages may connect.
    """

    name: str
    handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    origins: frozenset[str] = frozenset()

    @property
    def path(self) -> str:
        """Where it is served; also at `/` if there is no page."""
        return f"/{self.name}"
