"""Brokers for which too much waits: where a node's link would end, the exchange with them begins anew."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.mesh.broker_session import BrokerSession, BrokerSessions
    from broker.mesh.exports import MeshExports


class MeshOverflows:
    """Begins anew with brokers for which too much waits.

    Args:
        sessions: The exchanges with the brokers.
        exports: What they know of this broker.
        reset: Begins anew with a broker.
        warn: As for `Mesh`.

    Attributes:
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
        self._noted: dict[int, str] = {}
        self.count = 0

    def note(self, broker: int, text: str) -> None:
        """Note that a broker has not kept to flow control, for `handle` (`Routes.report_mesh`).

        Args:
            broker: The broker.
            text: What it has done, for the log.
        """
        self._noted[broker] = text

    def handle(self) -> None:
        """Begin anew with the brokers that have been noted."""
        while self._noted:
            broker, text = self._noted.popitem()
            self.begin_anew((broker,), text)

    def begin_anew(self, brokers: Iterable[int], text: str) -> None:
        """Forget the endpoints of brokers, and ask for them again.

        Args:
            brokers: The brokers.
            text: Why, for the log.
        """
        self.count += 1
        for broker in brokers:
            session = self._sessions.get(broker)
            if session is not None:
                self._warn("brokers begun anew with", broker, text)
                self._reset(broker, session)

    def lost_all(self, text: str) -> None:
        """Note that all that waited has been dropped, and begin anew with all brokers.

        Args:
            text: Why, for the log.
        """
        self._exports.lost_all()
        self.begin_anew(self._sessions.names(), text)
