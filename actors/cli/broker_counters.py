"""Measure topics with the broker's counters, without a subscription.

The counters are read every 20 ms, so that slow rates become exact soon. A report costs more with more
topics and links, so that reading takes at most 3 % of the time, but happens at least once a second.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.bridges.graph import ORIGIN_LABEL
from actors.cli.broker_target import open_inspector
from actors.cli.errors import TIMEOUT, CommandError
from actors.cli.named import TOPIC, print_unpublished
from actors.cli.output import print_err
from actors.errors import BrokerUnreachable
from actors.session.start_hint import start_hint
from actors.tools.rates import LEAST_SEC, CounterRate
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterable, Iterator

    from actors.cli.parsing import Options
    from actors.graph.broker_report import BrokerReport
    from actors.graph.inspector import Inspector

PRINT_EVERY_SEC: Final = 1.0
READ_EVERY_SEC: Final = 0.02
READ_SHARE: Final = 0.03


class WatchedTopic:
    """A topic whose counters are read.

    Attributes:
        topic: Its full name.
        counter: Its rate so far.
        new: Messages since the last output.
    """

    def __init__(self, topic: str, window: int, *, least_sec: float = LEAST_SEC) -> None:
        self.topic = topic
        self._new_counter = partial(CounterRate, window, least_sec=least_sec)
        self.counter = self._new_counter()
        self.new = 0

    def add(self, report: BrokerReport | None) -> None:
        """Add a report; None if the broker is lost: its counters may begin at 0 again."""
        if report is None:
            self.counter = self._new_counter()
            return
        found, before = report.topics.get(self.topic), self.counter.total
        messages, size_bytes = (found.messages, found.bytes) if found else (0, 0)
        first = not self.counter.begun
        self.counter.add(report.totals.stamp_sec, messages, size_bytes)
        if not first:
            self.new += messages - before if messages >= before else messages


def watch(
    options: argparse.Namespace, default_window: int, show: Callable[[list[WatchedTopic]], bool]
) -> int:
    """Call `show` once a second, which returns whether there was anything to show; return the exit code.

    Raises:
        InvalidTopicNameError: A topic name is invalid.
        CommandError: No message arrived within `--timeout`.
    """
    window, least_sec = (options.window, 0.0) if options.window else (default_window, LEAST_SEC)
    names = dict.fromkeys(map(TOPIC.full_name, options.topics))
    watched = [WatchedTopic(name, window, least_sec=least_sec) for name in names]
    with open_inspector(options) as inspector:
        _warn_unpublished(inspector.report(), watched)
        silent_sec = 0.0
        for _ in ticks(ReportReader(inspector).read, watched):
            silent_sec = 0.0 if any(each.new for each in watched) else silent_sec + PRINT_EVERY_SEC
            shown = show(watched)
            for each in watched:
                each.new = 0
            if options.once and shown:
                break
            if options.timeout is not None and silent_sec >= options.timeout:
                raise CommandError(f"No message on {', '.join(names)} within {options.timeout:g} s", TIMEOUT)
    return 0


class ReportReader:
    """Reads reports of a broker that may go and come back.

    Args:
        inspector: It is connected.
    """

    def __init__(self, inspector: Inspector) -> None:
        self._inspector = inspector
        self._hint = ""
        """The hint printed last while there is no broker."""

    def read(self) -> BrokerReport | None:
        """Return the broker's report. If the broker gives none, print each reason once and return None."""
        inspector = self._inspector
        try:
            if self._hint:
                inspector.connect()
            report = inspector.report()
        except BrokerUnreachable as error:
            inspector.close()
            hint = start_hint(inspector.urls[0], inspector.error if self._hint else None)
            if hint != self._hint:
                print_err(f"{error}; waiting for it to come back. {hint}")
            self._hint = hint
            return None
        self._hint = ""
        return report


def ticks(
    read: Callable[[], BrokerReport | None],
    watched: list[WatchedTopic],
    *,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], None] = time.sleep,
) -> Iterator[None]:
    """Read reports for the watched topics, and yield once a second, without drift.

    Without a broker it tries once a second.
    """
    due = clock() + PRINT_EVERY_SEC
    while True:
        began = clock()
        report = read()
        for each in watched:
            each.add(report)
        took = clock() - began
        if began >= due:
            due = max(due + PRINT_EVERY_SEC, began)
            yield
        rest_sec = max(READ_EVERY_SEC, took / READ_SHARE) if report else PRINT_EVERY_SEC
        pause(min(rest_sec, PRINT_EVERY_SEC))


def _warn_unpublished(report: BrokerReport, watched: list[WatchedTopic]) -> None:
    for each in watched:
        found = report.topics.get(each.topic)
        if found is None or not found.publishers:
            print_unpublished(each.topic, report.topics)


def publishes_elsewhere(options: Options, topics: Iterable[str]) -> bool:
    """Return whether topics have publishers of other brokers of the mesh, or beyond a bridge.

    A broker gets and counts their messages only while its own nodes subscribe.
    """
    names = set(map(TOPIC.full_name, topics))
    with open_inspector(options) as inspector:
        graph = inspector.graph()
        entries = [entry for entry in graph.of_kind(EntryKind.PUBLISHER) if entry.name in names]
        if any(ORIGIN_LABEL in graph.labels_of(entry) for entry in entries):
            return True
        brokers = {entry.broker for entry in entries}
        return any(brokers) and brokers != {next(iter(inspector.report().brokers), 0)}
