"""Decides which requests the web server answers. Pure: no I/O.

A page of another site must neither read nor control the graph, even if the server listens on loopback
only. So the Host header must be an address or a name of this server (no DNS rebinding), a request that has an
Origin must come from this server's own page, and controls need a token in a header, which no form and no link
of another site has.
"""

from __future__ import annotations

import hmac
import re
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from proto.wire.addresses import is_address

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

TOKEN_BYTES: Final = 24

HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Headers of every response."""

MAX_PORT: Final = 65_535

_HOST: Final = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]{1,255})(?::([0-9]{0,5}))?")
"""A name or an IPv4 address, or an IPv6 address in brackets, and the port."""

SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})


def new_token() -> str:
    """Return a new random token."""
    return secrets.token_urlsafe(TOKEN_BYTES)


@dataclass(frozen=True, kw_only=True, slots=True)
class Refusal:
    """Why a request is refused.

    Attributes:
        status: The status of the answer.
        reason: One line for the response.
    """

    status: int
    reason: str


@dataclass(frozen=True, kw_only=True, slots=True)
class AccessPolicy:
    """The requirements on a request.

    Attributes:
        token: The token that grants control, and reading if `private`.
        hosts: The names by which the server may be called, in lower case and without a port, besides
            `localhost` and all addresses: DNS cannot make an address lead to another machine.
        private: Whether reading needs a token, too.
        control: Whether anything may be controlled.
    """

    token: str
    hosts: frozenset[str] = frozenset()
    private: bool = False
    control: bool = False

    def refuses_origin(
        self, headers: Mapping[str, str], *, token: str = "", origins: Collection[str] = ()
    ) -> Refusal | None:
        """Return why a request cannot come from this server's page or from a program; None if it can.

        Args:
            headers: Of the request; keys in any case.
            token: A token in its address, where there may be one.
            origins: Sites whose pages may ask, too.
        """
        host = headers.get("Host", "")
        if host and not _is_host(host):
            return Refusal(
                status=421, reason="The Host header is not a name or an address, and perhaps a port"
            )
        # With the token the name may be anything: a page of another site does not have the token.
        if not self._knows(host) and not self.knows_token(bearer(headers) or token):
            text = "This server does not go by that name: use the address that it printed, or --allow-host"
            return Refusal(status=421, reason=text)
        origin = headers.get("Origin")
        if origin is not None:
            own = origin in origins or origin.partition("://")[2] == host
        else:  # a link on another site may open this page: the other site cannot read it
            own = headers.get("Sec-Fetch-Site", "none") in {"none", "same-origin"}
            own = own or headers.get("Sec-Fetch-Dest") == "document"
        return None if own else Refusal(status=403, reason="Pages of other sites may not ask this server")

    def refuses_reading(self, *, known: bool, private: bool = False) -> Refusal | None:
        """Return why a request may not read; None if it may.

        Args:
            known: Whether it has a valid token.
            private: Whether reading needs one now, although it does not always.
        """
        if not (self.private or private) or known:
            return None
        return Refusal(
            status=401,
            reason="A token is required: that in the printed address, or with --users a user's own",
        )

    def refuses_control(self, *, known: bool) -> Refusal | None:
        """Return why a request may not control anything; None if it may.

        Args:
            known: Whether it has a valid token in the Authorization header.
        """
        if not self.control:
            return Refusal(status=403, reason="This server is read-only: start it with --allow-control")
        if not known:
            return Refusal(
                status=401, reason="Control needs the token in the address that the server printed"
            )
        return None

    def knows_token(self, token: str) -> bool:
        """Return whether this is the token of the server.

        Args:
            token: As presented.
        """
        # Compared in constant time, so as bytes; aiohttp has surrogates for bytes that are not UTF-8.
        return hmac.compare_digest(token.encode(errors="surrogateescape"), self.token.encode())

    def _knows(self, host: str) -> bool:
        name = urlsplit(f"//{host}").hostname or ""
        return name == "localhost" or name in self.hosts or is_address(name)


def _is_host(host: str) -> bool:
    """Return whether a Host header is well-formed, so that everything that splits it finds the same parts."""
    found = _HOST.fullmatch(host)
    if found is None:
        return False
    name, port = found.groups()
    return int(port or 0) <= MAX_PORT and (not name.startswith("[") or is_address(name[1:-1]))


def bearer(headers: Mapping[str, str]) -> str:
    """Return the token of an Authorization header; empty without one.

    Args:
        headers: Of the request.
    """
    scheme, _, token = headers.get("Authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else ""
