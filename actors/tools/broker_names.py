"""The brokers of a mesh by their names, which need not be unique. Pure: nothing here does I/O."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from proto.wire.mesh_keys import broker_id

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.graph.broker_report import BrokerReport


class BrokerNames:
    """The names of the brokers that a report knows.

    Args:
        report: The report of one of them.

    Attributes:
        several: Whether there is more than one.
    """

    def __init__(self, report: BrokerReport) -> None:
        brokers = report.brokers.values()
        shared = Counter(each.name for each in brokers)
        self._names = {each.number: each.name for each in brokers if each.name and shared[each.name] == 1}
        self._titles = {each.number: each.name for each in brokers if each.name}
        self.several = len(report.brokers) > 1

    def __getitem__(self, number: int) -> str:
        """Return the name of a broker, with its id if others have the same name; the id if it has none."""
        name = self._names.get(number)
        if name is not None:
            return name
        title = self._titles.get(number)
        return broker_id(number) if title is None else f"{title} ({broker_id(number)})"

    def joined(self, numbers: Iterable[int]) -> str:
        """Return the names of brokers, sorted, once each, separated by commas.

        Args:
            numbers: The brokers.
        """
        return ", ".join(sorted({self[number] for number in numbers}))
