"""The state that handlers share, and functions that get it from a request."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web.options import MAX_LIVE_CONNECTIONS
from actors.web.workspace import Workspace

if TYPE_CHECKING:
    from collections.abc import Generator

    from actors.web.options import WebOptions
    from actors.web.security import AccessPolicy
    from actors.web.users import Users


@dataclass(kw_only=True, slots=True)
class State:
    """The state that handlers share.

    Attributes:
        options: Those of the server.
        policy: Who may ask for what.
        own: The workspace of the server itself.
        users: Those of the broker; None if they cannot sign in here.
        live_connections: How many browsers and streams are connected now.
        sockets: The WebSockets of browsers, which the server closes when it stops.
    """

    options: WebOptions
    policy: AccessPolicy
    own: Workspace
    users: Users | None
    live_connections: int = 0
    sockets: set[web.WebSocketResponse[bool]] = field(default_factory=set[web.WebSocketResponse[bool]])

    @contextmanager
    def live_connection(self) -> Generator[None]:
        """Count a browser or stream as long as it is connected.

        Raises:
            web.HTTPServiceUnavailable: `MAX_LIVE_CONNECTIONS` are connected already.
        """
        if self.live_connections >= MAX_LIVE_CONNECTIONS:
            raise web.HTTPServiceUnavailable(
                text=f"{MAX_LIVE_CONNECTIONS} browsers and streams are connected already"
            )
        self.live_connections += 1
        try:
            yield
        finally:
            self.live_connections -= 1


STATE: Final = web.AppKey("STATE", State)
WORKSPACE: Final = web.RequestKey("WORKSPACE", Workspace)


def state_of(request: web.Request) -> State:
    """Return the state that all handlers share."""
    return request.app[STATE]


def workspace_of(request: web.Request) -> Workspace:
    """Return the workspace in whose name a request is handled."""
    return request[WORKSPACE]
