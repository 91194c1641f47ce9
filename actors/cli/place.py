"""Which broker a command talks to, and what to say when there is none."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from actors import environment
from actors.cli.interrupts import raise_at_once
from actors.errors import BrokerUnreachable
from proto.url import DEFAULT_PORT, DEFAULT_URL, parse_urls

if TYPE_CHECKING:
    import argparse
    from collections.abc import Generator

    from actors.inspector import Inspector
    from proto.url import BrokerUrl

CONNECT_TIMEOUT_SEC: Final = 2.0
_HERE: Final = {"127.0.0.1", "::1", "localhost"}


def broker_urls(options: argparse.Namespace) -> tuple[BrokerUrl, ...]:
    """Return where the broker is: `--url`, then CALLBOARD_URL, then the default.

    Raises:
        InvalidUrlError: The URL cannot be read.
    """
    return parse_urls(options.url or environment.broker_url() or DEFAULT_URL)


@contextmanager
def inspector(options: argparse.Namespace) -> Generator[Inspector]:
    """Look at the graph that the options name. A signal ends it at once.

    Raises:
        BrokerUnreachable: No broker within 2 s; the text says how to start one.
    """
    from actors.inspector import Inspector  # noqa: PLC0415 - `--help` needs none

    urls = broker_urls(options)
    domain = options.domain if options.domain is not None else environment.domain_id() or 0
    raise_at_once()
    look = Inspector(",".join(map(str, urls)), domain=domain, timeout_sec=CONNECT_TIMEOUT_SEC)
    try:
        look.connect()
    except BrokerUnreachable:
        raise BrokerUnreachable(missing_broker(urls)) from None
    with look:
        yield look


def missing_broker(urls: tuple[BrokerUrl, ...]) -> str:
    """Say in one line that there is no broker, and what starts one."""
    return f"No broker at {', '.join(map(str, urls))}. Start one{_remedy(urls[0])}"


def _remedy(url: BrokerUrl) -> str:
    if url.path:
        return f" with: callboard broker --unix {url.path}"
    port = "" if url.port == DEFAULT_PORT else f" --port {url.port}"
    if url.host in _HERE:
        return f" with: callboard broker{port}"
    return f" there with: callboard broker --host {url.host}{port}"
