"""Brokers for which too much waits: where a node's link would end, the session with them is reset."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.mesh.broker_session import BrokerSession, BrokerSessions
    from broker.mesh.exports import MeshExports


class MeshOverflows:
    """Resets the sessions with brokers for which too much waits.

    Args:
        sessions: The sessions with the brokers.
        exports: What they know of this broker.
        reset: Resets the session with a broker.
        warn: As for `Mesh`.

    Attributes:
        noted: Brokers for `handle`, and what they have done.
        count: How often too much waited.
    """

    def __init__(
        self,
        sessions: BrokerSessions,
        exports: MeshExports,
        reset: Callable[[int, BrokerSession], None],
        warn: Callable[[str, int, str], None],
    ) -> None:
        self._sessions = sessions
        self._exports = exports
        self._reset = reset
        self._warn = warn
        self.noted: dict[int, str] = {}
        self.count = 0

    def note(self, broker: int, text: str) -> None:
        """Note that a broker has not kept to flow control, for `handle` (`Routes.report_mesh`).

        Args:
            broker: The broker.
            text: What it has done, for the log.
        """
        self.noted[broker] = text

    def handle(self) -> None:
        """Reset the sessions with the brokers that have been noted."""
        # Not at once in `note`: that is called while the router routes, and a reset changes its routes.
        while self.noted:
            broker, text = self.noted.popitem()
            self.reset((broker,), text)

    def reset(self, brokers: Iterable[int], text: str) -> None:
        """Forget the endpoints of brokers, and ask for them again.

        Args:
            brokers: The brokers.
            text: Why, for the log.
        """
        self.count += 1
        for broker in brokers:
            session = self._sessions.get(broker)
            if session is not None:
                self._warn("reset the session with", broker, text)
                self._reset(broker, session)

    def lost_all(self, text: str) -> None:
        """Note that all that waited has been dropped, and reset all sessions.

        Args:
            text: Why, for the log.
        """
        self._exports.lost_all()
        self.reset(self._sessions.names(), text)
