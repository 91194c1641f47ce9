"""When certificates in PEM files expire, which the standard library verifies, but does not show.

Only the part of DER (ITU-T X.690) is read that leads to a certificate's validity (RFC 5280, 4.1). Pure.
"""

from __future__ import annotations

import re
from base64 import b64decode
from datetime import UTC, datetime
from typing import Final

_PEM: Final = re.compile(r"-----BEGIN CERTIFICATE-----(.*?)-----END CERTIFICATE-----", re.DOTALL)
_SEQUENCE: Final = 0x30
_VERSION: Final = 0xA0
_UTC_TIME: Final = 0x17
_GENERALIZED_TIME: Final = 0x18
_PIVOT: Final = 50
"""Years of two digits below it are of this century (RFC 5280, 4.1.2.5.1)."""


def expiries(text: str) -> list[float]:
    """Return when each certificate in a PEM text expires, in seconds since the epoch.

    Args:
        text: The content of a PEM file; other parts of it, such as keys, are ignored.

    Returns:
        At least one time.

    Raises:
        ValueError: There is no certificate in it, or one is broken.
    """
    found = [_expiry(b64decode(body)) for body in _PEM.findall(text)]
    if not found:
        raise ValueError("it has no certificate in PEM format")
    return found


def _expiry(der: bytes) -> float:
    try:
        _, certificate, _ = _element(der)
        _, fields, _ = _element(certificate)
        tag, _, rest = _element(fields)
        # version (optional), serial number, signature algorithm, issuer, validity
        for _ in range(3 if tag == _VERSION else 2):
            _, _, rest = _element(rest)
        tag, validity, _ = _element(rest)
        if tag != _SEQUENCE:
            raise ValueError
        _, _, rest = _element(validity)
        tag, end, _ = _element(rest)
        return _time(tag, end.decode("ascii"))
    except (IndexError, ValueError) as error:
        raise ValueError("a certificate in it is broken") from error


def _element(data: bytes) -> tuple[int, bytes, bytes]:
    """Return the tag and the content of the first element, and what follows it."""
    tag, length, start = data[0], data[1], 2
    if length >= 0x80:
        start += length & 0x7F
        length = int.from_bytes(data[2:start], "big")
    if len(data) < start + length:
        raise ValueError
    return tag, data[start : start + length], data[start + length :]


def _time(tag: int, text: str) -> float:
    if tag == _UTC_TIME:
        text = ("20" if int(text[:2]) < _PIVOT else "19") + text
    elif tag != _GENERALIZED_TIME:
        raise ValueError
    return datetime.strptime(text, "%Y%m%d%H%M%SZ").replace(tzinfo=UTC).timestamp()
