"""Live tools: programs with WebSocket protocols of their own, which the server speaks beside its page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actors.web import limits

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from aiohttp import web


HEARTBEAT_SEC: Final = 2 * limits.UNREAD_SEC
"""Seconds without anything from a client until it is pinged. It has half as many to answer: on a slow link,
the ping waits behind what the kernel holds."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LiveTool:
    """The protocol of a live tool.

    A client shows its token in the Authorization header, or as `token` in the query of the address: a browser
    gives a WebSocket no header. The cookie of the page does not count, as it comes from any site's page.

    Attributes:
        name: As in `WebOptions.tools`.
        handler: Answers requests to connect.
        origins: Sites of the tool itself, whose pages may connect.
        open_control: Whether control needs no token where reading needs none: its usual clients have no place
            for one, other programs of this machine can ask the broker, and pages of other sites are refused.
    """

    name: str
    handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    origins: frozenset[str] = frozenset()
    open_control: bool = False

    @property
    def path(self) -> str:
        """Where it is served; also at `/` if there is no page."""
        return f"/{self.name}"
