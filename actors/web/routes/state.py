"""The state that handlers share, and functions that get it from a request."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from secrets import token_hex
from typing import TYPE_CHECKING, Final

from aiohttp import web

from actors.web import limits
from actors.web.connection import WebConnection
from actors.web.refusals import Refusal
from actors.web.shares import Shares
from actors.web.workspace import Workspace

if TYPE_CHECKING:
    from collections.abc import Generator, Mapping
    from contextlib import AbstractContextManager

    from actors.web.listener import WebListener
    from actors.web.options import WebOptions
    from actors.web.routes.live_tool import LiveTool
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
        listener: Has all connections.
        tools: The live tools, by path.
        sockets: The WebSockets of browsers and tools, which the server closes when it stops.
        session_id: Tells clients whether the server is still the same.
    """

    options: WebOptions
    policy: AccessPolicy
    own: Workspace
    users: Users | None
    listener: WebListener
    tools: Mapping[str, LiveTool]
    sockets: set[web.WebSocketResponse[bool]] = field(default_factory=set[web.WebSocketResponse[bool]])
    session_id: str = field(default_factory=partial(token_hex, 8))
    _streams: Shares = field(init=False)
    _bodies: Shares = field(init=False)

    def __post_init__(self) -> None:
        """Make the shares."""
        count = self.listener.refusals.count
        self._streams = Shares("browsers and streams", partial(count, Refusal.STREAMS))
        self._bodies = Shares("bytes in bodies of requests", partial(count, Refusal.BODIES))

    @property
    def private(self) -> bool:
        """Whether reading needs a token: beyond this machine, or if the broker is not for all who use it."""
        return self.policy.private or (not self.options.read_without_token and self.own.observer.guarded)

    @contextmanager
    def live_connection(self, request: web.Request) -> Generator[None]:
        """Count a browser or stream as long as it is connected; end it if it needs a token from now on.

        Raises:
            ShareUsedUpError: `MAX_HOLDER_STREAMS` of one holder, or `MAX_STREAMS`, are connected already.
        """
        connection, shows_token = request[CONNECTION], request[SHOWS_TOKEN]

        def check() -> None:
            if self.private and not shows_token:  # the broker has been started again, with access rules
                connection.abort()

        share, total = limits.MAX_HOLDER_STREAMS, limits.MAX_STREAMS
        with self._streams.use(connection.holder, 1, share=share, total=total):
            end = self.own.observer.on_graph(check)
            try:
                yield
            finally:
                end()

    def body(self, request: web.Request, size: int) -> AbstractContextManager[None]:
        """Count the body of a request as long as it is needed.

        Raises:
            ShareUsedUpError: `MAX_HOLDER_HELD_BYTES` of one holder, or `MAX_HELD_BYTES`, are held already.
        """
        holder = request[CONNECTION].holder
        return self._bodies.use(holder, size, share=limits.MAX_HOLDER_HELD_BYTES, total=limits.MAX_HELD_BYTES)


STATE: Final = web.AppKey("STATE", State)
CONNECTION: Final = web.RequestKey("CONNECTION", WebConnection)
SHOWS_TOKEN: Final = web.RequestKey("SHOWS_TOKEN", bool)
WORKSPACE: Final = web.RequestKey("WORKSPACE", Workspace)


def state_of(request: web.Request) -> State:
    """Return the state that all handlers share."""
    return request.app[STATE]


def tool_of(request: web.Request) -> LiveTool | None:
    """Return the live tool whose path a request names; None for the page and its API."""
    return state_of(request).tools.get(request.path)


def control_refusal(request: web.Request) -> str:
    """Return why a request may not control anything; "" if it may."""
    state, tool = state_of(request), tool_of(request)
    is_open = tool is not None and tool.open_control and not state.private
    refusal = state.policy.refuses_control(known=request[SHOWS_TOKEN] or is_open)
    return "" if refusal is None else refusal.reason


def workspace_of(request: web.Request) -> Workspace:
    """Return the workspace in whose name a request is handled."""
    return request[WORKSPACE]
