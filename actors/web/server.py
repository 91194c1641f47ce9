"""The web server: an ordinary client of a broker, in a process of its own."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from functools import partial
from typing import TYPE_CHECKING, Final, Self

from aiohttp import web

from actors.web import limits
from actors.web.listener import WebListener
from actors.web.page_files import PageFiles
from actors.web.refusals import Refusal
from actors.web.request_log import RequestLog
from actors.web.routes import (
    calls,
    echo,
    foxglove,
    goals,
    graph,
    images,
    lifecycle,
    live,
    log,
    openapi,
    operations,
    parameters,
    rosbridge,
    session,
)
from actors.web.routes.request_body import check_headers, expect_nothing, receive_body, refuse_body
from actors.web.routes.responses import error_response, respond
from actors.web.routes.state import CONNECTION, SHOWS_TOKEN, STATE, WORKSPACE, State, state_of, tool_of
from actors.web.security import HEADERS, SAFE_METHODS, AccessPolicy, bearer, new_token
from actors.web.users import Users, require_users
from actors.web.workspace import Workspace
from proto.errors import CallboardError
from proto.wire.addresses import is_loopback

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from types import TracebackType

    from actors.web.connection import WebConnection
    from actors.web.observer import Observer
    from actors.web.options import WebOptions
    from actors.web.routes.live_tool import LiveTool

    Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

ROUTES: Final = (
    *calls.ROUTES,
    *echo.ROUTES,
    *images.ROUTES,
    *goals.ROUTES,
    *parameters.ROUTES,
    *lifecycle.ROUTES,
    *log.ROUTES,
    *session.ROUTES,
    *graph.ROUTES,
    *live.ROUTES,
    *openapi.ROUTES,
    *operations.ROUTES,
)
"""The order matters: in `graph` the rest of a path is a name, so it comes after `echo`, `images` and so
on."""

TOOLS: Final = {each.name: each for each in (foxglove.TOOL, rosbridge.TOOL)}
"""The live tools, by name."""

STOP_SEC: Final = 1.0
"""Time for handlers to end when the server stops."""

TOO_MANY_CONNECTIONS: Final = "The server has as many connections as it takes, or as it takes of you"

TAKE_BODIES: Final = frozenset(each.handler for each in ROUTES if each.body is not None)
"""Handlers of requests that have a body. What others send is never read."""

PROBES: Final = frozenset({"/healthz", "/readyz"})
"""Answered whatever the Host header is: orchestrators use changing addresses, and nothing here is secret."""

GUARDED_PATHS: Final = ("/api/", "/metrics")
"""Everything else holds no secret: the page itself, and whether the server and the broker answer."""


class WebListenError(CallboardError):
    """The web server cannot listen on its address. Choose another one."""


class WebServer:
    """Serves the page and the API of one graph.

    Args:
        observer: Watches the graph; entered, and left, by the caller.
        options: The options of the server.

    Entering raises WebListenError if the address cannot be used, and NoUsersError if the users of the broker
    should sign in and it has none.

    Attributes:
        token: The token that grants control, and beyond loopback also reading.
        port: The port; known once it is entered.
    """

    def __init__(self, observer: Observer, options: WebOptions) -> None:
        self.token = options.token or new_token()
        self.port = options.port
        self._options = options
        policy = AccessPolicy(
            token=self.token,
            hosts=frozenset(name.lower() for name in (*options.allowed_hosts, options.host)),
            private=options.users or not (is_loopback(options.host) or options.host == "localhost"),
            control=options.allow_control,
        )
        self._app = web.Application(
            middlewares=[_guard],
            handler_args={
                "keepalive_timeout": limits.KEEPALIVE_SEC,
                "auto_decompress": False,
                "read_bufsize": limits.READ_BYTES,
                "lingering_time": 0,  # `_guard` lingers, without reading
            },
        )
        self._listener = WebListener()
        count = self._listener.count
        self._app[STATE] = State(
            listener=self._listener,
            options=options,
            policy=policy,
            own=Workspace(observer),
            users=Users(observer, partial(count, Refusal.TOKENS)) if options.users else None,
            tools=_tools(options),
        )
        self._app.add_routes(_routes(self._app[STATE]))
        self._app[openapi.ALL_ROUTES] = ROUTES
        self._app.on_response_prepare.append(_add_headers)
        self._app.on_shutdown.append(_close_sockets)
        self._app.on_cleanup.append(_close_work)
        self._runner = web.AppRunner(
            self._app,
            access_log=None,
            logger=RequestLog(self._listener.refusals),
            shutdown_timeout=STOP_SEC,
            handler_cancellation=True,
        )

    @property
    def url(self) -> str:
        """The page's address, without the token."""
        options = self._options
        host = f"[{options.host}]" if ":" in options.host else options.host
        return f"{'http' if options.tls is None else 'https'}://{host}:{self.port}/"

    def tool_url(self, name: str) -> str:
        """Return the address of a live tool, with the token if it grants anything: it has to be kept secret.

        Args:
            name: Of the tool.
        """
        base = self.url.replace("http", "ws", 1) + (name if self._options.page else "")
        needed = self._app[STATE].private if TOOLS[name].open_control else self._needs_token
        return f"{base}?token={self.token}" if needed else base

    @property
    def _needs_token(self) -> bool:
        return self._app[STATE].private or self._options.allow_control

    @property
    def asks_for_token(self) -> bool:
        """Whether reading needs a token, although the server is for this machine only."""
        state = self._app[STATE]
        return state.private and not state.policy.private

    @property
    def url_with_token(self) -> str:
        """The page's address, with the token if it grants anything: in the fragment, which is never sent."""
        return f"{self.url}#token={self.token}" if self._needs_token else self.url

    async def __aenter__(self) -> Self:
        """Listen."""
        options = self._options
        if options.users:
            require_users(self._app[STATE].own.observer)
        await self._runner.setup()
        server = self._runner.server
        assert server is not None
        try:
            await self._listener.listen(options.host, options.port, server, options.tls)
        except (OSError, UnicodeError) as error:  # the latter from a name that cannot be one
            await self._runner.cleanup()
            reason = getattr(error, "strerror", None) or str(error)
            raise WebListenError(f"Cannot listen on {options.host}:{options.port}: {reason}") from None
        self.port = self._listener.port
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Disconnect all browsers."""
        await self._listener.stop_listening()
        await self._runner.cleanup()
        self._listener.close()


def _tools(options: WebOptions) -> dict[str, LiveTool]:
    """Return the live tools of a server, by path."""
    tools = [TOOLS[name] for name in options.tools]
    found = {each.path: each for each in tools}
    return found if options.page else {"/": tools[0], **found}


def _routes(state: State) -> list[web.RouteDef]:
    with_page = state.options.page
    routes = [each.definition() for each in (ROUTES if with_page else operations.ROUTES)]
    routes += [
        web.get(path, tool.handler, expect_handler=expect_nothing) for path, tool in state.tools.items()
    ]
    if with_page:
        # Not below /api/: an unknown path there is an error for a program, and not the page.
        routes.append(web.get("/{path:(?!api/).*}", PageFiles().serve, expect_handler=expect_nothing))
    # The library's own routes for everything else fail at a header `Expect` that is not ASCII.
    return [*routes, web.route("*", "/{path:.*}", _refuse, expect_handler=expect_nothing)]


@web.middleware
async def _guard(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Refuse pages of other sites and unknown tokens; answer errors as JSON."""
    state = state_of(request)
    connection = request[CONNECTION] = state.listener.connection_of(request)
    with connection.handling():
        response = await _answer(request, handler, state)
        if state.listener.in_reserve(connection):
            response.force_close()
        if not request.content.is_eof():
            await _answer_early(request, response, connection)
    return response


async def _answer(request: web.Request, handler: Handler, state: State) -> web.StreamResponse:
    if request.path not in PROBES:
        if state.listener.in_reserve(request[CONNECTION]):
            state.listener.count(Refusal.CONNECTIONS, request[CONNECTION].source)
            return error_response(503, TOO_MANY_CONNECTIONS)
        tool = tool_of(request)
        origins = () if tool is None else tool.origins.union(state.options.allowed_origins)
        token = "" if tool is None else _token_for_tool(request)
        if refusal := state.policy.refuses_origin(request.headers, token=token, origins=origins):
            return error_response(refusal.status, refusal.reason)
    return await respond(partial(_admit, partial(_handle, handler)), request)


async def _answer_early(
    request: web.Request, response: web.StreamResponse, connection: WebConnection
) -> None:
    """Answer before the body has arrived, do not read it, and close the connection."""
    with connection.waiting():
        response.force_close()
        await response.prepare(request)
        await response.write_eof()
        connection.stop_reading()
        await asyncio.sleep(limits.LINGER_SEC)


async def _admit(handler: Handler, request: web.Request) -> web.StreamResponse:
    """Handle a request in the workspace of its user, if the access policy allows it."""
    state, safe = state_of(request), request.method in SAFE_METHODS
    request[WORKSPACE] = state.own
    is_guarded, is_tool = request.path.startswith(GUARDED_PATHS), tool_of(request) is not None
    if not (is_guarded or is_tool) or (request.method, request.path) in session.NEED_NO_TOKEN:
        return await handler(request)
    token = _token_for_tool(request) if is_tool else bearer(request.headers)
    # A cookie only for reading: a browser sends it by itself, also when a page of another site asks.
    if safe and not token and not is_tool:
        token = request.cookies.get(session.cookie_name(request), "")
    known = state.policy.knows_token(token)
    is_users = state.users is not None and bool(token) and not known
    reading = partial(state.policy.refuses_reading, private=state.private)
    request[SHOWS_TOKEN] = known or is_users
    refuses = reading if safe else state.policy.refuses_control
    if refusal := refuses(known=request[SHOWS_TOKEN]):
        return error_response(refusal.status, refusal.reason)
    connection = request[CONNECTION]
    if state.users is None or not is_users:
        if known:
            state.listener.prove(connection, None)
        return await handler(request)
    async with AsyncExitStack() as stack:
        with connection.waiting():
            opening = state.users.workspace(token, connection.address)
            workspace = await stack.enter_async_context(opening)
        if not state.listener.prove(connection, workspace.observer.node.user):
            response = error_response(503, TOO_MANY_CONNECTIONS)
            response.force_close()
            return response
        request[WORKSPACE] = workspace
        return await handler(request)


def _token_for_tool(request: web.Request) -> str:
    return bearer(request.headers) or request.query.get("token", "")


async def _handle(handler: Handler, request: web.Request) -> web.StreamResponse:
    """Handle a request when its body has arrived, if it may have one."""
    check_headers(request)
    connection = request[CONNECTION]
    if request.match_info.handler not in TAKE_BODIES:
        refuse_body(request)
        return await handler(request)
    if (request.method, request.path) in session.NEED_NO_TOKEN:  # the limits of connections suffice
        with connection.waiting():
            await receive_body(request, most=limits.MAX_SIGN_IN_BYTES, seconds=limits.SIGN_IN_SEC)
        return await handler(request)
    most = limits.MAX_BODY_BYTES
    size = request.content_length
    with state_of(request).body(request, most if size is None else min(size, most)):
        with connection.waiting():
            await receive_body(request, most=most, seconds=limits.BODY_SEC)
        return await handler(request)


async def _refuse(request: web.Request) -> web.StreamResponse:
    """Refuse a request that has no route, or another method than its route."""
    methods: set[str] = set()
    for resource in request.app.router.resources():
        methods |= (await resource.resolve(request))[1]
    methods.discard("*")  # the route of this function
    raise web.HTTPMethodNotAllowed(request.method, methods) if methods else web.HTTPNotFound


async def _add_headers(_: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(HEADERS)
    if response.content_type == "application/json":
        response.headers.setdefault("Cache-Control", "no-store")


async def _close_sockets(app: web.Application) -> None:
    for socket in tuple(app[STATE].sockets):
        await socket.close(code=1001, message=b"the server stops")


async def _close_work(app: web.Application) -> None:
    await app[STATE].own.close()
    if (users := app[STATE].users) is not None:
        await users.close()
