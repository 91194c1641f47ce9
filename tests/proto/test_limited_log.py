"""Lines that peers cause: ten of a reason, then one sum in each period, then ten again after a quiet one."""

from __future__ import annotations

from proto.limited_log import MAX_LINES, MAX_REASONS, OTHER_REASONS, PERIOD_SEC, LimitedLog


class Clock:
    """Time that the test sets, and the sums that were logged."""

    def __init__(self) -> None:
        self.now = 100.0
        self.sums: list[tuple[int, str]] = []
        self.log = LimitedLog(lambda omitted, reason: self.sums.append((omitted, reason)), lambda: self.now)

    def lines(self, count: int, reason: str = "a") -> int:
        """Return how many of so many lines may be logged."""
        return sum(self.log.admits(reason) for _ in range(count))


def test_ten_lines_then_sums() -> None:
    """Case 56: in each period one sum; each reason has its own."""
    clock = Clock()
    assert clock.lines(22_000) == MAX_LINES
    assert clock.lines(3, "b") == 3
    assert clock.log.omitting
    clock.now += PERIOD_SEC
    assert clock.lines(5) == 0
    assert clock.sums == [(21_990, "a")]
    assert clock.lines(20, "b") == MAX_LINES
    clock.now += PERIOD_SEC
    clock.log.report_omitted()
    assert clock.sums[1:] == [(5, "a"), (10, "b")]
    assert not clock.log.omitting


def test_a_quiet_period_ends_the_limit() -> None:
    """The next lines are logged again; at the end everything is counted."""
    clock = Clock()
    clock.lines(11)
    clock.now += PERIOD_SEC
    clock.log.report_omitted()
    clock.now += PERIOD_SEC
    assert clock.lines(12) == MAX_LINES
    clock.log.report_omitted(at_once=True)
    clock.log.report_omitted(at_once=True)
    assert clock.sums == [(1, "a"), (2, "a")]


def test_the_number_of_reasons_is_limited() -> None:
    """Case 56: reasons that a peer chooses fill no memory; quiet ones make space for others."""
    clock = Clock()
    assert sum(clock.lines(1, str(number)) for number in range(1000)) == MAX_REASONS + MAX_LINES
    clock.log.report_omitted(at_once=True)
    assert clock.sums == [(1000 - MAX_REASONS - MAX_LINES, OTHER_REASONS)]
    clock.now += PERIOD_SEC
    assert clock.lines(1, "new") == 1
