"""The options of the web server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from ssl import SSLContext

DEFAULT_HOST: Final = "127.0.0.1"
DEFAULT_PORT: Final = 7412


@dataclass(frozen=True, kw_only=True, slots=True)
class WebOptions:
    """The options of the web server.

    Attributes:
        host: The address to listen on.
        port: The port; 0 for any that is free.
        allow_control: Whether calls, goals, parameters and transitions are allowed, with the token.
        token: The token that grants control, and beyond loopback also reading; None for a random one.
        users: Whether the users of the broker sign in with their own tokens, and have their own rights.
        allowed_hosts: Names that a Host header may have, besides `localhost`, all addresses and `host`.
        page: Whether the page and its API are served, not only the live tools.
        tools: Names of the live tools that may connect; see `actors.web.routes.live_tool`.
        allowed_origins: Sites whose pages may connect as live tools, such as "https://tools.example".
        read_without_token: Whether everybody on this machine may read without a token, also if the broker
            asks for credentials, or is for its owner only.
        tls: The context for HTTPS; None for HTTP.
    """

    host: str = DEFAULT_HOST
    port: int = DEFAULT_PORT
    allow_control: bool = False
    token: str | None = None
    users: bool = False
    allowed_hosts: tuple[str, ...] = ()
    page: bool = True
    tools: tuple[str, ...] = ()
    allowed_origins: tuple[str, ...] = ()
    read_without_token: bool = False
    tls: SSLContext | None = None
