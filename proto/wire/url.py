"""Broker URLs: `callboard://host:port`, `callboards://host:port` (TLS), `callboard+unix:///path`."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final, NamedTuple
from urllib.parse import urlsplit

from proto.errors import InvalidUrlError

DEFAULT_HOST: Final = "127.0.0.1"
DEFAULT_PORT: Final = 7411
DEFAULT_URL: Final = f"callboard://{DEFAULT_HOST}:{DEFAULT_PORT}"

LOOPBACK_HOSTS: Final = frozenset({DEFAULT_HOST, "::1", "localhost"})
"""The usual hosts of the loopback device, recognised without reading an address."""

_EXAMPLE: Final = f"write it like {DEFAULT_URL} or callboard+unix:///run/callboard.sock"


_USERINFO: Final = re.compile(r"//[^/]*@")
"""The part of a URL that an error text must not repeat, since it may be a password."""


class BrokerUrl(NamedTuple):
    """The address of a broker: a host and port, or the path of a unix socket (host empty, port 0).

    `tls` says whether the broker speaks TLS there; a unix socket has none.
    """

    host: str
    port: int
    path: str = ""
    tls: bool = False

    @property
    def is_local(self) -> bool:
        """Whether it is on this machine for certain: at a unix socket or the loopback device."""
        if self.path or self.host in LOOPBACK_HOSTS:
            return True
        from proto.wire.addresses import is_loopback  # noqa: PLC0415 - rarely needed

        return is_loopback(self.host)

    def __str__(self) -> str:
        if self.path:
            return f"callboard+unix://{self.path}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'callboards' if self.tls else 'callboard'}://{host}:{self.port}"


def parse_url(text: str) -> BrokerUrl:
    """Parse one broker URL; a missing port is 7411.

    Raises:
        InvalidUrlError: The URL is invalid; the text says why and gives an example.
    """
    # Errors are logged, and some users write a password into a URL although callboard has none there.
    safe = _USERINFO.sub("//***@", text)
    try:
        parts = urlsplit(text)
        port = DEFAULT_PORT if parts.port is None else parts.port
    except ValueError as error:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: {error}; {_EXAMPLE}") from error
    if parts.query or parts.fragment or parts.username is not None:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: only a host, port or path; {_EXAMPLE}")
    if parts.scheme == "callboard+unix":
        if parts.netloc or not parts.path.strip("/"):
            raise InvalidUrlError(f"Invalid broker URL {safe!r}: needs an absolute path; {_EXAMPLE}")
        return BrokerUrl("", 0, parts.path)
    if parts.scheme not in {"callboard", "callboards"}:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: unknown scheme; {_EXAMPLE}")
    if not parts.hostname:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: no host; {_EXAMPLE}")
    if parts.path not in {"", "/"}:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: a TCP URL has no path; {_EXAMPLE}")
    if port == 0:
        raise InvalidUrlError(f"Invalid broker URL {safe!r}: nothing listens on port 0; {_EXAMPLE}")
    return BrokerUrl(parts.hostname, port, tls=parts.scheme == "callboards")


@lru_cache(maxsize=16)
def parse_urls(text: str) -> tuple[BrokerUrl, ...]:
    """Parse a comma-separated list of broker URLs, in the order in which to try them.

    Raises:
        InvalidUrlError: One of them is invalid, or the list is empty.
    """
    urls = tuple(parse_url(part.strip()) for part in text.split(",") if part.strip())
    if not urls:
        raise InvalidUrlError(f"No broker URL given; {_EXAMPLE}")
    return urls
