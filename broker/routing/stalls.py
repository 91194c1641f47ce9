"""KEEP_ALL subscriptions that take nothing and hold publishers back (docs/protocol.md §6.5.9)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from broker.routing.records import PublisherRecord, SubscriptionRecord


class Stalls:
    """Finds the subscriptions of one graph that have granted nothing for too long.

    Args:
        stall_sec: Seconds that a subscription may hold a publisher back without a GRANT.
        max_sec: The longest time that a subscription may ask for.

    Attributes:
        count: Subscriptions whose credit was suspended so far.
    """

    def __init__(self, *, stall_sec: float, max_sec: float) -> None:
        self._stall_sec = stall_sec
        self._max_sec = max(stall_sec, max_sec)
        self._since: dict[SubscriptionRecord, float] = {}
        self.count = 0

    def limit_sec(self, subscription: SubscriptionRecord) -> float:
        """Return for how many seconds a subscription may hold publishers back without a GRANT."""
        return min(max(self._stall_sec, subscription.stall_ms / 1000), self._max_sec)

    def describe(self, subscription: SubscriptionRecord) -> str:
        """Return what a stalled subscription has done, as the end of a sentence."""
        seconds = self.limit_sec(subscription)
        return f"has taken nothing for {seconds:g} s and held back its publishers; they wait no longer"

    def end(self, subscription: SubscriptionRecord) -> None:
        """Note that a subscription has granted credit."""
        self._since.pop(subscription, None)

    def check(self, publishers: Iterable[PublisherRecord], now: float) -> list[SubscriptionRecord]:
        """Return the subscriptions that have stalled for too long; call it regularly."""
        # Rebuilt at each check instead of being kept up to date: nothing per message, and readers that are
        # gone or served again drop out by themselves.
        before = self._since
        self._since = {
            reader: before.get(reader, now) for each in publishers for reader in _holding_back(each)
        }
        due = [reader for reader, since in self._since.items() if now - since >= self.limit_sec(reader)]
        self.count += len(due)
        return due


def _holding_back(publisher: PublisherRecord) -> Iterator[SubscriptionRecord]:
    """Return the subscriptions whose credit for a publisher is used up."""
    credit = publisher.credit
    if not publisher.waits_for_readers or not credit.used_up(publisher.next_sequence):
        return
    for subscription in publisher.matched.values():
        if credit.limits.used_up(subscription.key, publisher.next_sequence, credit.bytes):
            yield subscription
