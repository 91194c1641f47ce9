"""Admission of connections: how many an address may have, and the user of each. Pure."""

from __future__ import annotations

from collections import Counter, OrderedDict
from typing import TYPE_CHECKING, Final

from broker.access.errors import Unauthorized
from proto.wire.addresses import owned_by_one

if TYPE_CHECKING:
    from broker.access.origin import Origin
    from broker.access.rules import AccessRules, Principal
    from proto.wire.addresses import Address

MAX_FAILURES: Final = 10
"""Failed attempts of one address within FAILURE_PERIOD_SEC that are answered at once."""

FAILURE_PERIOD_SEC: Final = 60.0

MAX_FAILING_ADDRESSES: Final = 10_000
"""Addresses whose failures are counted; beyond it the one that failed first is forgotten."""

NOT_AUTHORIZED: Final = "this broker requires a valid token or client certificate"
"""Does not say which of them was missing or wrong, or whether the user exists."""

PLAIN_TOKEN: Final = (
    "a token must not travel over plain TCP: use TLS, or start the broker with --insecure, too"  # noqa: S105
)


def source_of(origin: Origin) -> Address | None:
    """Return the address or network that limits apply to; None for this machine."""
    return None if origin.local or origin.address is None else owned_by_one(origin.address)


class Admission:
    """Decides which connections one broker accepts.

    Args:
        rules: The access rules; None if everybody may do everything.
        max_per_address: Limit on connections from one address; those from this machine are not counted.
        plain_tokens: Whether tokens may come over plain TCP from other machines.

    Attributes:
        rules: As given; replaced on a reload.
        unauthorized: Failed attempts so far.
    """

    def __init__(self, rules: AccessRules | None, *, max_per_address: int, plain_tokens: bool) -> None:
        self.rules = rules
        self.unauthorized = 0
        self._max_per_address = max_per_address
        self._plain_tokens = plain_tokens
        self._connections: Counter[Address] = Counter()
        self._failures: OrderedDict[Address | None, tuple[float, int]] = OrderedDict()

    def enter(self, origin: Origin) -> str:
        """Count a new connection.

        Returns:
            Why it is refused, for the peer; "" if it is accepted. Call `leave` in both cases.
        """
        source = source_of(origin)
        if source is None:
            return ""
        self._connections[source] += 1
        if self._connections[source] <= self._max_per_address:
            return ""
        return (
            f"this broker accepts at most {self._max_per_address} connections from one address"
            " (its --max-connections-per-address)"
        )

    def leave(self, origin: Origin) -> None:
        """Forget a connection that has ended."""
        source = source_of(origin)
        if source is None:
            return
        self._connections[source] -= 1
        if self._connections[source] <= 0:
            del self._connections[source]

    def identify(self, origin: Origin, token: object, now: float) -> Principal | None:
        """Return the user of a connection; None if there are no rules.

        Args:
            origin: Where it comes from.
            token: The token of its HELLO, None if it has none; anything but a string is a wrong token.
            now: Loop time.

        Raises:
            Unauthorized: Its credentials belong to no user, or its token has travelled unencrypted.
        """
        if self.rules is None:
            return None
        if token is not None and not (origin.encrypted or origin.local or self._plain_tokens):
            # Refused even if the token is right: others on the network may have read it.
            self._fail(origin, now)
            raise Unauthorized(PLAIN_TOKEN)
        principal = None
        if token is None or isinstance(token, str):
            principal = self.rules.authenticate(origin, token)
        if principal is None:
            raise Unauthorized(NOT_AUTHORIZED, late=self._fail(origin, now) > MAX_FAILURES)
        return principal

    def _fail(self, origin: Origin, now: float) -> int:
        """Count a failure; return the number of failures of the address in the current period."""
        self.unauthorized += 1
        source = source_of(origin)
        since, count = self._failures.get(source, (now, 0))
        if now - since > FAILURE_PERIOD_SEC:
            since, count = now, 0
            # Deleted, so that it is added at the end again: the dict is in the order of first failures.
            del self._failures[source]
        self._failures[source] = since, count + 1
        while len(self._failures) > MAX_FAILING_ADDRESSES:
            self._failures.popitem(last=False)
        return count + 1
