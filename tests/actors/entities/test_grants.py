"""Grants: at the attachment, when half is taken, and to nobody while leftovers wait."""

from __future__ import annotations

from typing import Any

from actors.entities.backlog import Batch
from actors.entities.grants import Grants
from actors.entities.ledger import Ledger
from actors.entities.window import FIRST_BYTES, FIRST_MESSAGES, WINDOW_MESSAGES
from actors.feeds import Inflow
from proto.frames import Attached, Run


class Nobody:
    """A reader, and an event, that are not looked at."""

    def add(self, count: int) -> None:
        """Count nothing."""


class Bench:
    """A ledger, its grants, and the sequence limits that have been sent."""

    def __init__(self) -> None:
        nobody: Any = Nobody()
        self.sent: list[tuple[int, int]] = []
        self.ledger = Ledger(nobody, latched=False)
        self.grants = Grants(self.ledger, self._send)

    def _send(self, inflow: Inflow) -> None:
        self.sent.append((inflow.publisher, inflow.granted_sequence))

    def attach(self, publisher: int) -> Inflow:
        """Let a publisher come."""
        nobody: Any = Nobody()
        gid = bytes([publisher]) * 16
        inflow = Inflow(nobody, Attached(publisher, (1,), gid, 0, "/talker", {}))
        self.ledger.attached(inflow)
        self.grants.attached(inflow)
        return inflow

    def detach(self, inflow: Inflow, newest: Batch | None) -> None:
        """Let a publisher go, while something waits, or nothing."""
        self.ledger.detached(inflow)
        self.grants.detached(newest)


def batch(inflow: Inflow, end: int) -> Batch:
    """Return what waits of a publisher, up to a number."""
    run = Run(inflow.publisher, 0, 0, end, None, None, b"", b"")
    made = Batch(inflow, run, [None] * end, range(end), 0)
    made.end, made.size = end, 10 * end
    return made


def test_a_publisher_is_granted_a_window_when_it_comes_and_another_when_half_is_taken() -> None:
    """So a grant is sent for each half of a window."""
    bench = Bench()
    assert bench.grants.declare() == (FIRST_MESSAGES, FIRST_BYTES)
    inflow = bench.attach(1)
    assert bench.sent == [(1, WINDOW_MESSAGES)]
    assert bench.grants.limit == WINDOW_MESSAGES
    half = WINDOW_MESSAGES // 2
    bench.grants.taken(inflow, half, 10)
    assert len(bench.sent) == 1
    bench.grants.taken(inflow, half + 1, 10)
    assert bench.sent[1:] == [(1, half + 1 + WINDOW_MESSAGES)]


def test_while_leftovers_wait_nobody_is_granted_anything() -> None:
    """Neither by the declaration nor at the attachment; when they are taken, everybody gets a window."""
    bench = Bench()
    old = bench.attach(1)
    leftover = batch(old, 3)
    bench.detach(old, leftover)
    assert bench.grants.declare() == (0, 0)
    bench.sent.clear()
    bench.attach(2)
    bench.attach(3)
    assert bench.sent == []
    bench.grants.finished(leftover)
    assert [publisher for publisher, _ in bench.sent] == [2, 3]
    assert bench.grants.declare() == (FIRST_MESSAGES, FIRST_BYTES)


def test_what_is_taken_of_a_publisher_that_has_gone_grants_nothing() -> None:
    """Its number may be another's in the next session."""
    bench = Bench()
    inflow = bench.attach(1)
    bench.detach(inflow, None)
    bench.sent.clear()
    bench.grants.taken(inflow, 10 * WINDOW_MESSAGES, 10)
    assert bench.sent == []
