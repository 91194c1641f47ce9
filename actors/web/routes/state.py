"""What handlers find in the application."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web.workspace import Workspace

if TYPE_CHECKING:
    from actors.web.assets import Assets
    from actors.web.options import WebOptions
    from actors.web.security import AccessPolicy
    from actors.web.users import Users


@dataclass(kw_only=True, slots=True)
class State:
    """What handlers share.

    Attributes:
        options: What the server was told.
        policy: Who may ask for what.
        own: What it does in its own name.
        users: Those of the broker; None if they cannot sign in here.
        assets: The page's files.
        live: How many browsers and streams are connected now.
        sockets: Those of the browsers, for the stop.
    """

    options: WebOptions
    policy: AccessPolicy
    own: Workspace
    users: Users | None
    assets: Assets
    live: int = 0
    sockets: set[web.WebSocketResponse[bool]] = field(default_factory=set[web.WebSocketResponse[bool]])


STATE: Final = web.AppKey("STATE", State)
WORKSPACE: Final = web.RequestKey("WORKSPACE", Workspace)


def state_of(request: web.Request) -> State:
    """Return what handlers share."""
    return request.app[STATE]


def workspace_of(request: web.Request) -> Workspace:
    """Return the workspace of whoever asks."""
    return request[WORKSPACE]
