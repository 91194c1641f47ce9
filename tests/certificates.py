"""Certificates for tests, from authorities of their own."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from typing import TYPE_CHECKING

import trustme

from broker import BrokerOptions
from proto.wire.tls import TlsFiles

if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any

HOUR = dt.timedelta(hours=1)


@dataclass(frozen=True)
class Pair:
    """The PEM files of one certificate."""

    certificate: Path
    key: Path


class Authority:
    """An authority that writes what it issues into a folder.

    Attributes:
        ca: Its own certificate.
    """

    def __init__(self, folder: Path, name: str = "ca") -> None:
        self._folder = folder
        self._authority = trustme.CA(organization_name=name)
        self._name = name
        self.ca = folder / f"{name}.pem"
        self._authority.cert_pem.write_to_path(self.ca)

    def issue(self, *names: str, **options: Any) -> Pair:
        """Issue a certificate; issuing one with the same names replaces the files."""
        issued = self._authority.issue_cert(*names, **options)
        stem = f"{self._name}-{names[0] if names else options['common_name']}"
        pair = Pair(self._folder / f"{stem}.pem", self._folder / f"{stem}.key")
        pair.certificate.write_bytes(b"".join(part.bytes() for part in issued.cert_chain_pems))
        issued.private_key_pem.write_to_path(pair.key)
        return pair

    def options(self, pair: Pair | None = None, **options: Any) -> BrokerOptions:
        """Return the options of a broker with a certificate for this machine, or with another."""
        pair = pair or self.issue("127.0.0.1", "localhost")
        return BrokerOptions(port=0, tls_cert=pair.certificate, tls_key=pair.key, **options)

    def files(self, pair: Pair | None = None) -> TlsFiles:
        """Return the files of a client that trusts this authority."""
        return TlsFiles(str(self.ca), str(pair.certificate) if pair else "", str(pair.key) if pair else "")


def expired() -> dict[str, dt.datetime]:
    """Return the options of a certificate that has expired."""
    now = dt.datetime.now(dt.UTC)
    return {"not_before": now - 2 * HOUR, "not_after": now - HOUR}


def not_yet_valid() -> dict[str, dt.datetime]:
    """Return the options of a certificate of the future."""
    now = dt.datetime.now(dt.UTC)
    return {"not_before": now + HOUR, "not_after": now + 2 * HOUR}
