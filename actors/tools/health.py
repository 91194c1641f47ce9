"""Check this machine, the broker, and the nodes connected to it.

    for check in examine():
        print(check.status, check.name, check.finding, check.remedy)

It checks Python and this machine (`machine_checks`), files with secrets and certificates (`security_checks`),
finds the broker as a node does, and checks whom it lets in, its counters and its graph (`broker_checks`). It
changes nothing; each request may take `timeout_sec`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.config.contexts import find_broker_target
from actors.errors import BrokerUnreachable, TlsFailed
from actors.graph.inspector import inspector_for
from actors.session.start_hint import start_hint
from actors.tools import broker_checks, machine_checks, security_checks
from actors.tools.check import Check
from proto.aio.local_socket import connect_beside
from proto.errors import CallboardError, ErrorCode, ProtocolError
from proto.wire.tls import TlsFault

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.config.contexts import BrokerTarget
    from proto.wire.url import BrokerUrl

TIMEOUT_SEC: Final = 2.0
TLS_HELP: Final = "docs/security.md says what each TLS error means"
_TLS_REMEDIES: Final = {
    TlsFault.UNKNOWN_CA: "export CALLBOARD_CA=/path/to/ca.pem, the file of the authority that has signed the"
    " broker's certificate (docs/security.md)"
}
OTHER_PROGRAM: Final = "see what listens there: another program may have the port"


def examine(
    url: str | None = None,
    domain: int | None = None,
    context: str | None = None,
    *,
    timeout_sec: float = TIMEOUT_SEC,
) -> list[Check]:
    """Run all checks.

    Args:
        url: The broker; None for the one that nodes use, as `actors.config.contexts` chooses it.
        domain: The domain id; None as above.
        context: A named broker; None as above.
        timeout_sec: The time limit for connecting, and for each request.

    Returns:
        The results, in a useful order. Failures are results, too: nothing is raised.
    """
    checks = machine_checks.all_checks() + security_checks.client_files()
    try:
        target = find_broker_target(url, domain, context)
    except CallboardError as error:
        remedy = "give another with --url, or correct where it comes from"
        return [*checks, Check("broker", "fail", str(error), remedy)]
    return checks + _broker(target, timeout_sec)


def all_good(checks: Iterable[Check]) -> bool:
    """Return whether no check failed; warnings do not count.

    Args:
        checks: The results.
    """
    return all(check.status != "fail" for check in checks)


def _broker(target: BrokerTarget, timeout_sec: float) -> list[Check]:
    source = f" ({target.url_from})"
    inspector = inspector_for(target, timeout_sec)
    try:
        with inspector:
            milliseconds = f"{1000 * inspector.round_trip_sec:.1f} ms"
            welcome, ca = inspector.welcome, target.credentials.tls.ca
            transport = _transport(inspector.url)
            report, snapshot = inspector.report(), inspector.graph()
            return [
                Check("broker", "ok", f"{inspector.url} answers in {milliseconds}{source}"),
                *broker_checks.greeting(welcome, inspector.clock_ahead_sec, inspector.round_trip_sec),
                *security_checks.broker_certificate(inspector.certificate),
                security_checks.openness(inspector.url, welcome.get("broker"), timeout_sec, ca=ca),
                transport,
                broker_checks.shared_memory(welcome, report.totals),
                *broker_checks.numbers(report),
                *broker_checks.mesh(report, snapshot),
                *broker_checks.graph(snapshot),
            ]
    except BrokerUnreachable as error:
        if isinstance(error, TlsFailed):  # a broker may be there all the same
            remedy = _TLS_REMEDIES.get(error.fault, TLS_HELP)
        elif inspector.listening is None:
            remedy = start_hint(target.urls[0], inspector.error)
        else:
            remedy = OTHER_PROGRAM
        return [Check("broker", "fail", f"{error}{source}", remedy)]
    except ProtocolError as error:
        return [_refused(error, target)]


def _transport(url: BrokerUrl) -> Check:
    """Return what connects nodes of this user on this machine with the broker that answers at `url`."""
    if url.tls or url.path:
        return Check("transport", "ok", "TLS" if url.tls else "a unix socket")
    sock = connect_beside(url.host, url.port)
    if sock is None:
        text = "TCP: the broker is on another host or another user's, or has no unix socket beside its port"
        return Check("transport", "ok", text)
    sock.close()
    return Check("transport", "ok", "nodes here use the unix socket beside the broker's port")


def _refused(error: ProtocolError, target: BrokerTarget) -> Check:
    remedy = {
        ErrorCode.VERSION: "run the same version of callboard on both sides",
        ErrorCode.UNAUTHORIZED: "ask the operator of the broker for a token",
    }.get(error.code, OTHER_PROGRAM)
    return Check("broker", "fail", f"{target.url}: {error}", remedy)
