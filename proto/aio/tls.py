"""TLS contexts of brokers and clients, made of files.

The functions import `ssl` themselves: it takes milliseconds, and programs without TLS do not need it.
"""

from __future__ import annotations

import os
import socket
import stat
import sys
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, TypeGuard

from proto.errors import TlsFileError
from proto.wire.tls import describe

if TYPE_CHECKING:
    import ssl
    from pathlib import Path

    from proto.wire.tls import TlsFiles
    from proto.wire.url import BrokerUrl

_CONTEXTS: Final = 64
"""Contexts of clients that are kept: reading the system's authorities takes tens of milliseconds."""


def client_context(files: TlsFiles) -> ssl.SSLContext:
    """Return a context that verifies the broker's certificate and host name.

    It is made again when one of the files has changed.

    Raises:
        TlsFileError: A file cannot be used.
    """
    return _client_context(files, tuple(map(_version, files)))


def _version(path: str) -> tuple[int, int]:
    try:
        found = os.stat(path)  # noqa: PTH116 - pathlib is slower to import
    except OSError:  # reading it says why
        return 0, 0
    return found.st_mtime_ns, found.st_ino


@lru_cache(maxsize=_CONTEXTS)
def _client_context(files: TlsFiles, _versions: tuple[tuple[int, int], ...]) -> ssl.SSLContext:
    import ssl  # noqa: PLC0415

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    if files.ca:
        _load_ca(context, files.ca)
        # The file may have the broker's own certificate in place of its authority's.
        context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    else:
        context.load_default_certs()
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if files.certificate or files.key:
        if not (files.certificate and files.key):
            raise TlsFileError("A client certificate needs its key, and a key its certificate: name both")
        _load_certificate(context, files.certificate, files.key)
    return context


def server_context(certificate: Path, key: Path, client_ca: Path | None) -> ssl.SSLContext:
    """Return a broker's context.

    Args:
        certificate: Its certificate with the chain.
        key: Its private key.
        client_ca: The authorities whose certificates clients must have; None to ask for none.

    Raises:
        TlsFileError: A file cannot be used.
    """
    import ssl  # noqa: PLC0415

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION  # TLS 1.2: either can be abused
    context.num_tickets = 0  # nobody resumes sessions
    _load_certificate(context, certificate, key)
    if client_ca is not None:
        context.verify_mode = ssl.CERT_REQUIRED
        _load_ca(context, client_ca)
    return context


def _load_certificate(context: ssl.SSLContext, certificate: Path | str, key: Path | str) -> None:
    import ssl  # noqa: PLC0415

    for path in (certificate, key):
        _check_readable(path)

    def refuse_passphrase() -> str:
        raise TlsFileError(
            f"The key {key} is protected by a passphrase: store it without one, as nobody can be asked"
            " (openssl pkey -in KEY -out NEW_KEY), readable by its owner only"
        )

    try:
        context.load_cert_chain(certificate, key, refuse_passphrase)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            text = f"The key {key} does not belong to the certificate {certificate}"
            raise TlsFileError(f"{text}: name the pair that was made together") from error
        if not _has_certificates(certificate):
            raise TlsFileError(f"{certificate} has no certificate in PEM format") from error
        if error.reason == "EE_KEY_TOO_SMALL" or "TOO_WEAK" in (error.reason or ""):
            text = f"{certificate}: {describe(error)}: make a new one with a longer key"
            raise TlsFileError(text) from error
        raise TlsFileError(f"{key} has no private key in PEM format") from error


def _load_ca(context: ssl.SSLContext, path: Path | str) -> None:
    _check_readable(path)
    if not _has_certificates(path):
        raise TlsFileError(f"{path} has no certificate in PEM format")
    context.load_verify_locations(path)


def _check_readable(path: Path | str) -> None:
    try:
        # Each file is read more than once, which a named pipe cannot be: it would be waited for.
        regular = stat.S_ISREG(os.stat(path).st_mode)  # noqa: PTH116 - pathlib is slower to import
        if regular:
            open(path, "rb").close()  # noqa: PTH123
    except OSError as error:
        raise TlsFileError(f"Cannot read {path}: {error.strerror or error}") from error
    if not regular:
        raise TlsFileError(f"Cannot read {path}: not a regular file")


def _has_certificates(path: Path | str) -> bool:
    import ssl  # noqa: PLC0415

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(path)
    except ssl.SSLError:
        return False
    return True


def is_tls_error(error: BaseException | None) -> TypeGuard[ssl.SSLError]:
    """Return whether an error comes from TLS; the end of the stream does not."""
    if "ssl" not in sys.modules:
        return False
    import ssl  # noqa: PLC0415

    return isinstance(error, ssl.SSLError) and not isinstance(error, ssl.SSLEOFError)


def names_of_peer(url: BrokerUrl, files: TlsFiles, timeout_sec: float) -> tuple[str, ...]:
    """Return the names in a broker's certificate by another handshake, in which any name will do.

    The certificate must be from a trusted authority all the same, and nothing is sent to the broker.

    Returns:
        Host names and addresses; none if there is no answer in time.
    """
    try:
        context = _client_context.__wrapped__(files, ())  # not the one that others share
        context.check_hostname = False
        with (
            socket.create_connection((url.host, url.port), timeout_sec) as sock,
            context.wrap_socket(sock, server_hostname=url.host) as tls,
        ):
            certificate: dict[str, Any] = tls.getpeercert() or {}
    except (OSError, TlsFileError):
        return ()
    return tuple(str(value) for _, value in certificate.get("subjectAltName", ()))
