"""Explains failures of TLS between a client and a broker: the cause, and the remedy.

The errors are OpenSSL's: those of verifying a certificate have a number, the others the name of a reason.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from proto.untrusted_text import escape

if TYPE_CHECKING:
    from proto.wire.url import BrokerUrl

_SHOWN_NAMES: Final = 10
"""Names of a certificate that an error text lists."""


class TlsFiles(NamedTuple):
    """The PEM files that a client uses for TLS; "" for none.

    Attributes:
        ca: The authorities to trust, or the broker's own certificate; without it those of the system.
        certificate: The client's certificate with its chain, for brokers that ask for one.
        key: Its private key.
    """

    ca: str = ""
    certificate: str = ""
    key: str = ""


NO_FILES: Final = TlsFiles()


class TlsFault(Enum):
    """Why TLS with a broker failed."""

    EXPIRED = "the broker's certificate has expired"
    NOT_YET_VALID = "the broker's certificate is not valid yet"
    WRONG_HOST = "the broker's certificate is for another host"
    UNKNOWN_CA = "the broker's certificate is from an unknown authority"
    INVALID_CERTIFICATE = "the broker's certificate is invalid for another reason"
    NO_TLS = "the port does not speak TLS"
    TLS_REQUIRED = "the port speaks TLS only"
    CLIENT_CERTIFICATE_REQUIRED = "the broker requires a client certificate"
    CLIENT_CERTIFICATE_REFUSED = "the broker does not accept the client certificate"
    OTHER = "TLS failed for another reason"


_VERIFY_FAULTS: Final = {
    9: TlsFault.NOT_YET_VALID,
    10: TlsFault.EXPIRED,
    **dict.fromkeys((2, 18, 19, 20, 21), TlsFault.UNKNOWN_CA),
    **dict.fromkeys((62, 64), TlsFault.WRONG_HOST),
}
"""By X509_V_ERR number, from OpenSSL's x509_vfy.h."""

_REASONS: Final = {
    TlsFault.CLIENT_CERTIFICATE_REQUIRED: "TLSV13_ALERT_CERTIFICATE_REQUIRED SSLV3_ALERT_HANDSHAKE_FAILURE",
    TlsFault.CLIENT_CERTIFICATE_REFUSED: "TLSV1_ALERT_UNKNOWN_CA TLSV1_ALERT_ACCESS_DENIED"
    " TLSV1_ALERT_DECRYPT_ERROR SSLV3_ALERT_BAD_CERTIFICATE SSLV3_ALERT_UNSUPPORTED_CERTIFICATE"
    " SSLV3_ALERT_CERTIFICATE_EXPIRED SSLV3_ALERT_CERTIFICATE_REVOKED SSLV3_ALERT_CERTIFICATE_UNKNOWN",
    TlsFault.NO_TLS: "WRONG_VERSION_NUMBER HTTP_REQUEST UNKNOWN_PROTOCOL PACKET_LENGTH_TOO_LONG"
    " RECORD_LAYER_FAILURE UNEXPECTED_MESSAGE BAD_RECORD_TYPE",
}
"""Values of `ssl.SSLError.reason`: alerts of the broker, and bytes that are not TLS."""

_REASON_FAULTS: Final = {reason: fault for fault, reasons in _REASONS.items() for reason in reasons.split()}


def describe(error: OSError) -> str:
    """Return an error of TLS in a few words, for the broker's log."""
    return escape(getattr(error, "verify_message", "") or _words(error))


def _words(error: OSError) -> str:
    reason: str | None = getattr(error, "reason", None)
    return str(error) if reason is None else reason.lower().replace("_", " ")


def fault_of(error: OSError) -> TlsFault:
    """Return the cause of a failed handshake of a client."""
    code = getattr(error, "verify_code", None)
    if code is not None:
        return _VERIFY_FAULTS.get(code, TlsFault.INVALID_CERTIFICATE)
    return _REASON_FAULTS.get(getattr(error, "reason", None) or "", TlsFault.OTHER)


def explain(fault: TlsFault, url: BrokerUrl, files: TlsFiles, error: OSError, names: tuple[str, ...]) -> str:
    """Return the text of an error: why a client has no TLS session with a broker, and the remedy.

    Args:
        fault: The cause.
        url: The broker.
        files: The client's files.
        error: The error, for faults without a text of their own.
        names: The names in the broker's certificate, for WRONG_HOST.
    """
    broker = f"the broker at {url}"
    plain = url._replace(tls=False)
    known = f"not from an authority in {files.ca}" if files.ca else "from an authority unknown here"
    shown = ", ".join(escape(name) for name in names[:_SHOWN_NAMES]) or "other names"
    texts = {
        TlsFault.EXPIRED: f"The certificate of {broker} has expired: renew it and send the broker SIGHUP, or"
        " correct the clock of this machine",
        TlsFault.NOT_YET_VALID: f"The certificate of {broker} is not valid yet: compare the clocks of both"
        " machines",
        TlsFault.WRONG_HOST: f"The certificate of {broker} is for {shown}, not for {escape(url.host)}: use a"
        " URL with one of its names, or give the broker a certificate for this one",
        TlsFault.UNKNOWN_CA: f"The certificate of {broker} is {known}: name the file of its authority in"
        " CALLBOARD_CA, or in the context with --ca",
        TlsFault.INVALID_CERTIFICATE: f"The certificate of {broker} is invalid: {describe(error)}",
        TlsFault.NO_TLS: f"What listens at {url} does not speak TLS: for a broker without TLS, use {plain}",
        TlsFault.TLS_REQUIRED: f"The broker at {plain} speaks TLS only: use {plain._replace(tls=True)}",
        TlsFault.CLIENT_CERTIFICATE_REQUIRED: f"The broker at {url} requires a client"
        " certificate: name it and its key in CALLBOARD_CERT and CALLBOARD_KEY",
        TlsFault.CLIENT_CERTIFICATE_REFUSED: f"The broker at {url} does not accept the client"
        f" certificate {files.certificate} ({describe(error)}): it must be valid, and from an authority that"
        " the broker knows (its --tls-client-ca)",
    }
    return texts.get(fault) or f"No TLS session with {broker}: {describe(error)}"
