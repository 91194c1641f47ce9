"""The web server: an ordinary client of a broker, in a process of its own."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final, Self

from aiohttp import web

from actors.tools.graph_types import GraphTypes
from actors.web.assets import Assets
from actors.web.calls import Calls
from actors.web.goals import Goals
from actors.web.live.panels import Panels
from actors.web.metrics import Metrics
from actors.web.options import MAX_BODY_BYTES
from actors.web.probes import RoundTrips
from actors.web.routes import (
    calls,
    echo,
    goals,
    graph,
    lifecycle,
    live,
    log,
    openapi,
    operations,
    parameters,
    session,
)
from actors.web.routes.answers import answered, failure
from actors.web.routes.state import STATE, State, state_of
from actors.web.security import HEADERS, SAFE_METHODS, Door, bearer, new_token
from actors.web.topic_feed import TopicFeeds
from proto.addresses import is_loopback
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from types import TracebackType

    from actors.web.observer import Observer
    from actors.web.options import WebOptions

AREAS: Final = (calls, echo, goals, parameters, lifecycle, log, session, graph, live, openapi, operations)
"""The first that has a path answers it."""

KEEPALIVE_SEC: Final = 15.0
STOP_SEC: Final = 1.0
BODY_SEC: Final = 10.0
"""For the whole body of a request to arrive."""

GUARDED_PATHS: Final = ("/api/", "/metrics")
"""Everything else holds no secret: the page itself, and whether the server and the broker answer."""


class WebListenError(CallboardError):
    """The web server cannot listen on its address. Choose another one."""


class WebServer:
    """Serves the page and the API of one graph.

    Args:
        observer: Watches the graph; entered, and left, by the caller.
        options: What the server is told.

    Entering raises WebListenError if the address cannot be used.

    Attributes:
        token: What grants control, and beyond loopback also reading.
        port: The port; known once it is entered.
    """

    def __init__(self, observer: Observer, options: WebOptions) -> None:
        self.token = options.token or new_token()
        self.port = options.port
        self._options = options
        beyond = not is_loopback(options.host)
        door = Door(
            token=self.token,
            hosts=frozenset({*options.allowed_hosts, options.host}),
            private=beyond,
            control=options.allow_control,
        )
        feeds = TopicFeeds(observer)
        self._app = web.Application(
            middlewares=[_guard],
            client_max_size=MAX_BODY_BYTES,
            handler_args={"keepalive_timeout": KEEPALIVE_SEC},
        )
        assets, types, metrics = Assets(), GraphTypes(observer.node), Metrics()
        self._app[STATE] = State(
            options=options,
            door=door,
            observer=observer,
            feeds=feeds,
            panels=Panels(observer, feeds),
            assets=assets,
            types=types,
            calls=Calls(observer.node, types),
            goals=Goals(observer.node, types),
            metrics=metrics,
            round_trips=RoundTrips(observer.node, metrics.round_trips),
        )
        for area in AREAS:
            self._app.add_routes(area.ROUTES)
        self._app.add_routes([web.get("/{path:(?!api/).*}", assets.serve)])
        self._app.on_response_prepare.append(_add_headers)
        self._app.on_shutdown.append(_close_sockets)
        self._app.on_cleanup.append(_close_work)
        self._runner = web.AppRunner(
            self._app, access_log=None, shutdown_timeout=STOP_SEC, handler_cancellation=True
        )

    @property
    def url(self) -> str:
        """The page's address, without the token."""
        options = self._options
        host = f"[{options.host}]" if ":" in options.host else options.host
        return f"{'http' if options.tls is None else 'https'}://{host}:{self.port}/"

    @property
    def url_with_token(self) -> str:
        """The page's address, with the token if it grants anything: in the fragment, which is never sent."""
        needed = self._app[STATE].door.private or self._options.allow_control
        return f"{self.url}#token={self.token}" if needed else self.url

    async def __aenter__(self) -> Self:
        """Listen."""
        options = self._options
        await self._runner.setup()
        site = web.TCPSite(self._runner, options.host, options.port, ssl_context=options.tls)
        try:
            await site.start()
        except OSError as error:
            await self._runner.cleanup()
            reason = error.strerror or str(error)
            raise WebListenError(f"Cannot listen on {options.host}:{options.port}: {reason}") from None
        self.port = self._runner.addresses[0][1]
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Disconnect all browsers."""
        await self._runner.cleanup()


@web.middleware
async def _guard(
    request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
) -> web.StreamResponse:
    """Refuse what the door refuses; answer errors as JSON."""
    door = state_of(request).door
    refusal = door.refuses_origin(request.headers)
    signs_in = (request.method, request.path) == session.SIGN_IN
    if refusal is None and request.path.startswith(GUARDED_PATHS) and not signs_in:
        if request.method in SAFE_METHODS:
            refusal = door.refuses_reading(
                bearer(request.headers) or request.cookies.get(session.cookie_name(request), "")
            )
        else:
            refusal = door.refuses_control(bearer(request.headers))
    if refusal is not None:
        return failure(refusal.status, refusal.reason)
    try:
        async with asyncio.timeout(BODY_SEC):
            await request.read()
    except TimeoutError:
        return failure(408, f"The body of the request did not arrive within {BODY_SEC:g} s")
    except web.HTTPRequestEntityTooLarge:
        return failure(413, f"The body of the request has more than {MAX_BODY_BYTES} bytes")
    return await answered(handler, request)


async def _add_headers(_: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(HEADERS)
    if response.content_type == "application/json":
        response.headers.setdefault("Cache-Control", "no-store")


async def _close_sockets(app: web.Application) -> None:
    for socket in tuple(app[STATE].sockets):
        await socket.close(code=1001, message=b"the server stops")


async def _close_work(app: web.Application) -> None:
    await app[STATE].round_trips.close()
    await app[STATE].goals.close()
