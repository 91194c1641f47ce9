"""Errors for a client that has no TLS session with a broker."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.errors import TlsFailed
from proto.aio.tls import names_of_peer
from proto.wire.tls import TlsFault, explain, fault_of

if TYPE_CHECKING:
    from proto.wire.tls import TlsFiles
    from proto.wire.url import BrokerUrl

NAMES_TIMEOUT_SEC: Final = 1.0
"""For asking a broker with another name which names it has."""


def tls_failure(error: OSError, url: BrokerUrl, files: TlsFiles) -> TlsFailed:
    """Return the error about a handshake that failed.

    For a wrong host it connects again to learn the right ones, which may take NAMES_TIMEOUT_SEC.

    Args:
        error: As `proto.aio.tls.is_tls_error` recognises it.
        url: The broker.
        files: What the client used.
    """
    fault = fault_of(error)
    names = names_of_peer(url, files, NAMES_TIMEOUT_SEC) if fault is TlsFault.WRONG_HOST else ()
    return TlsFailed(fault, explain(fault, url, files, error, names))


def tls_required(url: BrokerUrl, files: TlsFiles) -> TlsFailed:
    """Return the error about a port that speaks TLS only, for a URL without TLS."""
    fault = TlsFault.TLS_REQUIRED
    return TlsFailed(fault, explain(fault, url, files, OSError(), ()))
