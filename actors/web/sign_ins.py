"""Attempts to sign in with tokens that are not known to be right.

The broker answers wrong tokens late, so whoever tries many of them fills any number of attempts. Each address
has a part of them, in which its attempts wait for each other.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from actors.errors import NotAuthorized
from actors.web import limits
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from proto.wire.addresses import Address


class TokenNotAcceptedError(CallboardError):
    """The broker has not accepted a token in time. It answers late after several wrong ones."""


class SignIns:
    """The attempts at one server.

    Args:
        on_wrong: Called with the address of a wrong token.
    """

    def __init__(self, on_wrong: Callable[[Address], object]) -> None:
        self._on_wrong = on_wrong
        self._all = asyncio.Semaphore(limits.MAX_SIGN_INS)
        self._of_addresses: dict[Address, asyncio.Semaphore] = {}
        self._users: Counter[Address] = Counter()
        self._accepted: dict[bytes, None] = {}

    @asynccontextmanager
    async def attempt(self, key: bytes, source: Address) -> AsyncGenerator[None]:
        """Wait until the broker may be asked about a token; one that it has accepted before does not wait.

        Args:
            key: The hash of the token.
            source: The address that it comes from.

        Raises:
            NotAuthorized, TokenNotAcceptedError: As the block, after the token has been counted.
        """
        try:
            if key in self._accepted:
                yield
            else:
                async with self._turn(source):
                    yield
        except (NotAuthorized, TokenNotAcceptedError):
            self._accepted.pop(key, None)
            self._on_wrong(source)
            raise
        self._accepted.pop(key, None)
        self._accepted[key] = None
        if len(self._accepted) > limits.MAX_ACCEPTED_TOKENS:
            del self._accepted[next(iter(self._accepted))]

    @asynccontextmanager
    async def _turn(self, source: Address) -> AsyncGenerator[None]:
        of_address = self._of_addresses.setdefault(source, asyncio.Semaphore(limits.MAX_SIGN_INS_OF_ADDRESS))
        self._users[source] += 1
        try:
            async with of_address, self._all:
                yield
        finally:
            self._users[source] -= 1
            if not self._users[source]:
                del self._users[source], self._of_addresses[source]
