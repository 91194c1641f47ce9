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
        client: The address of the client on whose behalf it is made, as its HELLO claims; None without a
            claim. Anybody may claim anything, so it only ever takes rights away.
    """

    address: Address | None
    encrypted: bool = False
    certificate_names: tuple[str, ...] = ()
    client: Address | None = None

    @property
    def local(self) -> bool:
        """Whether the connection comes from this machine, by loopback or a unix socket."""
        return is_local(self.address)

    @property
    def addresses(self) -> tuple[Address | None, ...]:
        """Its address and its client's, if it has one: rights need both."""
        return (self.address,) if self.client is None else (self.address, self.client)

    def __str__(self) -> str:
        """Return the address, and the client if there is one, as logs show them."""
        where = "this machine" if self.address is None else str(self.address)
        return where if self.client is None else f"{where} for {self.client}"


def is_local(address: Address | None) -> bool:
    """Return whether an address is of this machine; None is a unix socket's."""
    return address is None or address.is_loopback


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
