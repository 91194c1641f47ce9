"""Checks of security: files with secrets, certificates, brokers that let in anybody."""

from __future__ import annotations

import os
import socket
import stat
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from actors.config import environment
from actors.config.context_errors import ContextError
from actors.config.contexts import Contexts
from actors.config.credentials import Credentials
from actors.errors import TlsFailed
from actors.graph.inspector import Inspector
from actors.regular_files import read_regular
from actors.tools.certificates import expiries
from actors.tools.check import Check
from proto.errors import CallboardError
from proto.untrusted_text import escape
from proto.wire.addresses import is_loopback
from proto.wire.tls import TlsFault, TlsFiles
from proto.wire.url import LOOPBACK_HOSTS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proto.wire.url import BrokerUrl

MAX_PEM_BYTES: Final = 4 * 1024 * 1024
"""Far more than the authorities of a system have."""
SOON_DAYS: Final = 30
"""A certificate that expires earlier should be renewed now."""
_DAY_SEC: Final = 86_400
_ELSEWHERE: Final = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}
"""Addresses for documentation (RFC 5737, 3849), to which nothing is sent: the system only chooses the address
of this machine from which it would send."""


def client_files() -> list[Check]:
    """Return the checks of the secrets and certificates that nodes and commands of this user have."""
    tls = environment.tls_files()
    secrets = {"CALLBOARD_TOKEN_FILE": environment.token_file(), "CALLBOARD_KEY": tls.key}
    certificates = {"CALLBOARD_CERT": tls.certificate, "CALLBOARD_CA": tls.ca}
    with suppress(ContextError):  # another check reports it
        for name, context in Contexts.load().named.items():
            secrets |= {f"context '{name}'": context.token_file, f"context '{name}', key": context.key}
            certificates |= {f"context '{name}', cert": context.cert, f"context '{name}', ca": context.ca}
    return check_files(
        {name: path for name, path in secrets.items() if path},
        {name: path for name, path in certificates.items() if path},
    )


def check_files(secrets: Mapping[str, str], certificates: Mapping[str, str]) -> list[Check]:
    """Return the checks of files.

    Args:
        secrets: Paths of files that other users must not read, by the name of what refers to them.
        certificates: Paths of PEM files with certificates, likewise.
    """
    return [
        *(_secret(name, path) for name, path in secrets.items()),
        *(_certificate(name, path) for name, path in certificates.items()),
    ]


def _secret(name: str, path: str) -> Check:
    """Return the check of a file with a token, a key or access rules."""
    shown = f"{name}: {escape(path)}"
    try:
        mode = os.stat(path).st_mode  # noqa: PTH116 - a path from outside
    except (OSError, ValueError) as error:
        return Check("secrets", "fail", f"{shown} cannot be read: {_reason(error)}", f"correct {name}")
    if os.name == "posix" and mode & (stat.S_IROTH | stat.S_IWOTH):
        remedy = f"chmod o-rwx {escape(path)}; if others may have read it, replace the secret, too"
        return Check("secrets", "warn", f"{shown} can be read or written by every user", remedy)
    return Check("secrets", "ok", f"{shown} is hidden from other users")


def _certificate(name: str, path: str) -> Check:
    """Return the check of the certificate in a file that expires first."""
    shown = f"{name}: {escape(path)}"
    try:
        ends = expiries(read_regular(path, MAX_PEM_BYTES).decode("ascii", "replace"))
    except (OSError, ValueError) as error:
        return Check("certificates", "fail", f"{shown} cannot be read: {_reason(error)}", f"correct {name}")
    return check_expiry(shown, min(ends), time.time())


def check_expiry(shown: str, expires: float, now: float) -> Check:
    """Return the check of a certificate.

    Args:
        shown: Which it is, for the finding.
        expires: When it expires, in seconds since the epoch.
        now: The time.
    """
    days = int((expires - now) // _DAY_SEC)
    if expires <= now:
        return Check("certificates", "fail", f"{shown} has expired", "renew it")
    if days < SOON_DAYS:
        remedy = "renew it, and reload the broker (SIGHUP) if it is the broker's"
        return Check("certificates", "warn", f"{shown} expires in {days} days", remedy)
    return Check("certificates", "ok", f"{shown} is valid for {days} days")


def broker_certificate(certificate: Mapping[str, Any]) -> list[Check]:
    """Return the check of the certificate of a broker.

    Args:
        certificate: As `ssl.SSLSocket.getpeercert` shows it; empty without TLS.
    """
    if "notAfter" not in certificate:
        return []
    import ssl  # noqa: PLC0415 - loaded already, if there is a certificate

    expires = ssl.cert_time_to_seconds(certificate["notAfter"])
    return [check_expiry("the broker's certificate", expires, time.time())]


def openness(url: BrokerUrl, broker: object, timeout_sec: float, *, ca: str = "") -> Check:
    """Return the check of whether a broker lets in anybody from another machine.

    It connects without credentials: to the broker's address, or to this machine's own, IPv4 and IPv6, if that
    is a loopback address.

    Args:
        url: Where it has answered.
        broker: The identity in its greeting.
        timeout_sec: The time limit.
        ca: The authorities to trust for TLS; "" for those of the system.
    """
    local = url.host in LOOPBACK_HOSTS or is_loopback(url.host)
    hosts = () if url.path else own_addresses() if local else (url.host,)
    if not hosts:
        return Check("access", "ok", "only programs on this machine reach the broker")
    nothing, unknown = Credentials(tls=TlsFiles(ca=ca)), ""
    for host in hosts:
        outside = url._replace(host=host)
        try:
            with Inspector(str(outside), credentials=nothing, timeout_sec=timeout_sec) as stranger:
                if stranger.welcome.get("broker") != broker:
                    continue
        except CallboardError as error:
            if isinstance(error, TlsFailed) and error.fault is not TlsFault.CLIENT_CERTIFICATE_REQUIRED:
                unknown = unknown or f"it is unknown whether the broker lets in anybody: {error}"
            continue
        remedy = "say who may take part with --auth FILE, or let it listen on 127.0.0.1 (docs/security.md)"
        return Check("access", "warn", f"the broker lets in anybody who reaches {outside}", remedy)
    if unknown:
        return Check("access", "skip", unknown)
    return Check("access", "ok", "connections from other machines need credentials")


def own_addresses() -> tuple[str, ...]:
    """Return the addresses of this machine that others may reach: at most one of IPv4, then one of IPv6."""
    found: list[str] = []
    for family, elsewhere in _ELSEWHERE.items():
        with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as sock:
            sock.connect((elsewhere, 9))
            found.append(sock.getsockname()[0])
    return tuple(address for address in found if not is_loopback(address))


def _reason(error: OSError | ValueError) -> str:
    return escape((error.strerror if isinstance(error, OSError) else None) or str(error))
