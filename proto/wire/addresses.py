"""IP addresses as sockets report them."""

from __future__ import annotations

from functools import lru_cache
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import TypeAlias

from proto.limits import MAX_ADDRESS_CHARACTERS

Address: TypeAlias = IPv4Address | IPv6Address


@lru_cache(maxsize=1000)
def parse_address(text: str) -> Address:
    """Return the address in a string; that of an IPv4 client of an IPv6 socket as IPv4.

    Raises:
        ValueError: It is no address.
    """
    address = ip_address(text.partition("%")[0])  # without an IPv6 zone
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return mapped or address


def parse_client_address(value: object) -> Address:
    """Return the address in the option `client_address` of a HELLO.

    Raises:
        ValueError: It is no string with an address, or has an IPv6 zone, which means something on one host
            only.
    """
    if isinstance(value, str) and len(value) <= MAX_ADDRESS_CHARACTERS and "%" not in value:
        return parse_address(value)
    raise ValueError("no address")


def owned_by_one(address: Address) -> Address:
    """Return the address or network that limits on one peer apply to.

    The owner of one IPv6 address usually has all 2^64 of its /64 network, so the network counts.
    """
    return IPv6Address(int(address) >> 64 << 64) if isinstance(address, IPv6Address) else address


def is_loopback(text: str) -> bool:
    """Return whether a string is an address of the loopback device; False for names."""
    try:
        return parse_address(text).is_loopback
    except ValueError:
        return False


def is_address(text: str) -> bool:
    """Return whether a string is an address; False for names."""
    try:
        parse_address(text)
    except ValueError:
        return False
    return True
