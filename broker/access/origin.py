"""Where a connection comes from: the facts of its transport that access depends on."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address
from typing import TypeAlias

Address: TypeAlias = IPv4Address | IPv6Address
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


LOCAL = Origin(address=None)
"""A unix socket."""


def parse_address(text: str) -> Address:
    """Return the address in a text; that of an IPv4 client of an IPv6 socket as IPv4.

    Raises:
        ValueError: It is no address.
    """
    address = ip_address(text.partition("%")[0])  # without an IPv6 zone
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return mapped or address
