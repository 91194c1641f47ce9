"""Tokens: 256 random bits behind a recognisable prefix. Only their SHA-256 is stored.

A plain hash is enough for a random secret of that length, and it costs microseconds, so that attempts
cannot occupy the broker.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from typing import TYPE_CHECKING, Final

from proto.limits import MAX_TOKEN_CHARACTERS

if TYPE_CHECKING:
    from collections.abc import Mapping

TOKEN_PREFIX: Final = "cbt_"  # noqa: S105 - the beginning of every token, for scanners of leaked secrets
TOKEN_BYTES: Final = 32

HASH_PREFIX: Final = "sha256:"

_HASH: Final = re.compile(rf"{HASH_PREFIX}[0-9a-f]{{64}}")
_INDEX_BYTES: Final = 4


def is_token_hash(text: str) -> bool:
    """Return whether a string is a stored token: `sha256:` and 64 lower-case hexadecimal digits."""
    return _HASH.fullmatch(text) is not None


def hash_token(token: str) -> str:
    """Return how a token is stored."""
    return HASH_PREFIX + _digest(token).hex()


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()


class TokenIndex:
    """The stored tokens of all users.

    Args:
        users: The user of each stored token.
    """

    def __init__(self, users: Mapping[str, str]) -> None:
        self._users: dict[bytes, list[tuple[bytes, str]]] = {}
        for text, user in users.items():
            digest = bytes.fromhex(text.removeprefix(HASH_PREFIX))
            self._users.setdefault(digest[:_INDEX_BYTES], []).append((digest, user))

    def find(self, token: str) -> tuple[str, str]:
        """Return the user of a token, and how it is stored; two empty strings if no user has it."""
        if len(token) > MAX_TOKEN_CHARACTERS:  # a peer chooses its length, and hashing costs time
            return "", ""
        digest = _digest(token)
        found = "", ""
        # Found by a part of the hash, then compared in constant time: how long it takes tells an attacker at
        # most that part.
        for stored, user in self._users.get(digest[:_INDEX_BYTES], ()):
            if hmac.compare_digest(stored, digest):
                found = user, HASH_PREFIX + stored.hex()
        return found
