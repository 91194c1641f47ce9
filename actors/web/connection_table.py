"""Who holds how many connections, and which one is closed to make room. Pure.

A connection counts for its *holder*: the broker's user who has signed in on it, or the address that it comes
from. At a limit the holder with most connections loses one on which the server waits for the client. One that
has shown no valid token goes first, and among those the one that has waited for longest.

A connection for which there is no room waits in the *reserve*. Probes are answered there, so that a server
whose connections are all at work does not look dead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

from actors.web import limits

if TYPE_CHECKING:
    from collections.abc import Hashable

Connection = TypeVar("Connection", bound="Hashable")
Holder: TypeAlias = "Hashable"


@dataclass(slots=True)
class _Holding(Generic[Connection]):
    """The connections of one holder.

    Attributes:
        count: How many there are.
        waiting: Those without a valid token on which the server waits for the client, the oldest first.
        proven_waiting: Those with one.
    """

    count: int = 0
    waiting: dict[Connection, None] = field(default_factory=dict[Connection, None])
    proven_waiting: dict[Connection, None] = field(default_factory=dict[Connection, None])

    def oldest(self) -> Connection | None:
        """Return the connection that makes room; None if all are at work."""
        return next(iter(self.waiting), None) or next(iter(self.proven_waiting), None)


@dataclass(slots=True)
class _Entry:
    holder: Holder
    proven: bool = False


class ConnectionTable(Generic[Connection]):
    """The open connections of one server."""

    def __init__(self) -> None:
        self._entries: dict[Connection, _Entry] = {}
        self._holdings: dict[Holder, _Holding[Connection]] = {}
        self._reserve: dict[Connection, None] = {}

    def __len__(self) -> int:
        """Return how many are open, with the reserve."""
        return len(self._entries) + len(self._reserve)

    def connections(self) -> tuple[Connection, ...]:
        """Return those that are open, with the reserve."""
        return (*self._entries, *self._reserve)

    def in_reserve(self, connection: Connection) -> bool:
        """Return whether there was no room for a connection: only probes are answered on it."""
        return connection in self._reserve

    def enter(self, connection: Connection, holder: Holder) -> Connection | None:
        """Add a new connection, on which the server waits for the client.

        Args:
            connection: The connection.
            holder: The address that it comes from.

        Returns:
            The connection to close instead, which is removed already.
        """
        victim = None
        of_holder = self._holdings.get(holder)
        if of_holder is not None and of_holder.count >= limits.MAX_HOLDER_CONNECTIONS:
            victim = of_holder.oldest()
        elif len(self._entries) < limits.MAX_CONNECTIONS:
            self._add(connection, holder)
            return None
        else:
            victim = self._oldest_of_largest()
        if victim is not None:
            self.leave(victim)
            self._add(connection, holder)
            return victim
        self._reserve[connection] = None
        if len(self._reserve) <= limits.RESERVED_CONNECTIONS:
            return None
        victim = next(iter(self._reserve))
        del self._reserve[victim]
        return victim

    def leave(self, connection: Connection) -> None:
        """Remove a connection, unless it is removed already."""
        self._reserve.pop(connection, None)
        entry = self._entries.pop(connection, None)
        if entry is not None:
            self._take_from_holder(connection, entry)

    def work(self, connection: Connection) -> None:
        """Note that the server does something for the client: the connection is not closed to make room."""
        entry = self._entries.get(connection)
        if entry is not None:
            holding = self._holdings[entry.holder]
            holding.waiting.pop(connection, None)
            holding.proven_waiting.pop(connection, None)

    def wait(self, connection: Connection) -> None:
        """Note that the server waits for the client from now on: to send something, or to read."""
        entry = self._entries.get(connection)
        if entry is not None:
            holding = self._holdings[entry.holder]
            (holding.proven_waiting if entry.proven else holding.waiting)[connection] = None

    def prove(self, connection: Connection, holder: Holder | None) -> Connection | None:
        """Note that a connection, which is at work, has shown a valid token.

        Args:
            connection: The connection.
            holder: The broker's user; None if it goes on counting for its address.

        Returns:
            A connection of the user to close, which is removed already; the same one if all others of the
            user are at work.
        """
        entry = self._entries.get(connection)
        if entry is None:
            return None
        entry.proven = True
        if holder is None or holder == entry.holder:
            return None
        victim = None
        of_holder = self._holdings.get(holder)
        if of_holder is not None and of_holder.count >= limits.MAX_HOLDER_CONNECTIONS:
            victim = of_holder.oldest() or connection
            self.leave(victim)
        if victim is not connection:
            self._take_from_holder(connection, entry)
            entry.holder = holder
            self._holdings.setdefault(holder, _Holding()).count += 1
        return victim

    def _add(self, connection: Connection, holder: Holder) -> None:
        self._entries[connection] = _Entry(holder)
        holding = self._holdings.setdefault(holder, _Holding())
        holding.count += 1
        holding.waiting[connection] = None

    def _take_from_holder(self, connection: Connection, entry: _Entry) -> None:
        holding = self._holdings[entry.holder]
        holding.count -= 1
        holding.waiting.pop(connection, None)
        holding.proven_waiting.pop(connection, None)
        if not holding.count:
            del self._holdings[entry.holder]

    def _oldest_of_largest(self) -> Connection | None:
        holdings = self._holdings.values()
        strangers = [each for each in holdings if each.waiting]
        candidates = strangers or [each for each in holdings if each.proven_waiting]
        largest = max(candidates, key=lambda each: each.count, default=None)
        return None if largest is None else largest.oldest()
