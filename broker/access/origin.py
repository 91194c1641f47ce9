"""Where a connection comes from: the facts of its transport that access depends on."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Network
from typing import TYPE_CHECKING, Any, Final, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proto.wire.addresses import Address

Network: TypeAlias = IPv4Network | IPv6Network


@dataclass(frozen=True, kw_only=True, slots=True)
class Origin:
    """Where a connection comes from.

    Attributes:
        address: The other end's address; None for a unix socket.
        encrypted: Whether it uses TLS.
        certificate_names: The names in the client's verified certificate.
    """

    address: Address | None
    encrypted: bool = False
    certificate_names: tuple[str, ...] = ()

    @property
    def local(self) -> bool:
        """Whether it comes from this machine: by loopback or a unix socket."""
        return self.address is None or self.address.is_loopback

    def within(self, networks: tuple[Network, ...]) -> bool:
        """Return whether its address belongs to one of the networks."""
        address = self.address
        return address is not None and any(address in network for network in networks)


UNKNOWN: Final = Origin(address=IPv4Address(0))
"""An address that cannot be read: it is not local, and in no usual network."""

LOCAL: Final = Origin(address=None)
"""A unix socket."""


def certificate_names(certificate: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names in a certificate: the common name, then the alternative names.

    Args:
        certificate: As `ssl.SSLSocket.getpeercert` returns it; empty if it was not verified.
    """
    subject = [value for part in certificate.get("subject", ()) for key, value in part if key == "commonName"]
    return tuple(dict.fromkeys((*subject, *(value for _, value in certificate.get("subjectAltName", ())))))
