"""Windows over messages and counters; time is an argument, so none of it waits."""

from __future__ import annotations

from random import Random

import pytest

from actors.tools.rates import Bandwidth, CounterRate, Delay, Rate


def times(count: int, *, period: float = 1.0, jitter: float = 0.0, seed: int = 1) -> list[float]:
    """Return when messages of a steady publisher come."""
    chance = Random(seed)
    return [number * period + chance.uniform(0, jitter) for number in range(count)]


@pytest.mark.parametrize("jitter", [0.0, 0.004])
def test_one_hertz_is_one_hertz(jitter: float) -> None:
    """Within one percent from the second message on, with the gaps' spread."""
    rate = Rate()
    for number, time_sec in enumerate(times(20, jitter=jitter), 1):
        rate.add(time_sec)
        found = rate.summary()
        if number == 1:
            assert found is None
            continue
        assert found is not None
        assert found.per_sec == pytest.approx(1.0, rel=0.01)
        assert found.min_sec <= 1 / found.per_sec + 1e-9
        assert found.max_sec >= 1 / found.per_sec - 1e-9
        assert found.deviation_sec <= jitter
        assert found.window == number


def test_the_spread_of_gaps() -> None:
    """Gaps of 1, 2 and 3 s: half a message a second, and a deviation over all of them."""
    rate = Rate()
    for time_sec in (0, 1, 3, 6):
        rate.add(time_sec)
    found = rate.summary()
    assert found is not None
    assert found.per_sec == 0.5
    assert (found.min_sec, found.max_sec, found.window) == (1.0, 3.0, 4)
    assert found.deviation_sec == pytest.approx((2 / 3) ** 0.5)


def test_only_the_window_counts() -> None:
    """What was slow before is forgotten."""
    rate = Rate(3, least_sec=0.0)
    for time_sec in (0, 100, 200, 201, 202):
        rate.add(time_sec)
    assert rate.summary() == (1.0, 1.0, 1.0, 0.0, 3)


def test_a_run_is_one_arrival_of_many_messages() -> None:
    """Ten messages at once, twice a second, are twenty a second; a run may be cut by the window."""
    rate = Rate(1000, least_sec=0.0)
    for step in range(100):
        for _ in range(10):
            rate.add(step * 0.5)
    found = rate.summary()
    assert found is not None
    assert found.per_sec == pytest.approx(20)
    assert (found.min_sec, found.max_sec) == (0.0, 0.5)
    assert found.deviation_sec == pytest.approx(0.15, rel=0.02)
    small = Rate(15, least_sec=0.0)
    for time_sec in (0.0, 1.0):
        for _ in range(10):
            small.add(time_sec)
    few = small.summary()
    assert few is not None
    assert few._replace(deviation_sec=0.3) == (10.0, 0.0, 1.0, 0.3, 15)
    assert few.deviation_sec == pytest.approx(0.3)


def test_a_fast_topic_is_judged_by_a_second_at_least() -> None:
    """A burst that fills the window is not the rate."""
    rate = Rate(10)
    for step in range(40):
        for _ in range(100):
            rate.add(step * 0.1)
    found = rate.summary()
    assert found is not None
    assert found.per_sec == pytest.approx(1000)
    assert found.window == 1100


def test_messages_of_one_moment_have_no_rate() -> None:
    """Rather than a division by zero."""
    rate, exact = Rate(), Rate(2, least_sec=0.0)
    for _ in range(5):
        rate.add(7.0)
        exact.add(7.0)
    assert rate.summary() is None
    assert exact.summary() is None


def test_a_clock_that_is_set_back_begins_anew() -> None:
    """No negative gaps."""
    rate, bandwidth = Rate(), Bandwidth()
    for time_sec in (100.0, 101.0, 50.0, 50.5):
        rate.add(time_sec)
        bandwidth.add(time_sec, 10)
    assert rate.summary() == (2.0, 0.5, 0.5, 0.0, 2)
    seen = bandwidth.summary(51.0)
    assert seen is not None
    assert (seen.bytes_per_sec, seen.messages) == (20.0, 2)


def test_bandwidth_counts_until_now() -> None:
    """So that it falls when nothing comes any more."""
    bandwidth = Bandwidth()
    assert bandwidth.summary(1.0) is None
    bandwidth.add(0.0, 10)
    assert bandwidth.summary(0.0) is None
    bandwidth.add(1.0, 30)
    assert bandwidth.summary(2.0) == (20.0, 2, 20.0, 10, 30)
    assert bandwidth.summary(4.0) == (10.0, 2, 20.0, 10, 30)


def test_bandwidth_of_a_window() -> None:
    """Only the last messages; with `least_sec` those of that time, too."""
    exact, least = Bandwidth(2, least_sec=0.0), Bandwidth(2, least_sec=1.0)
    for bandwidth in (exact, least):
        for number in range(8):
            bandwidth.add(number / 4, 1000 - number)
    assert exact.summary(2.0) == (1987 / 0.5, 2, 993.5, 993, 994)
    seen = least.summary(2.0)
    assert seen is not None
    assert (seen.messages, seen.min_bytes, seen.max_bytes) == (5, 993, 997)


def test_delay() -> None:
    """Mean, extremes and deviation of the last messages."""
    delay = Delay(3)
    assert delay.summary() is None
    for age_sec in (100.0, 1.0, 2.0, 3.0):
        delay.add(age_sec)
    found = delay.summary()
    assert found is not None
    assert found._replace(deviation_sec=0.0) == (2.0, 1.0, 3.0, 0.0, 3)
    assert found.deviation_sec == pytest.approx((2 / 3) ** 0.5)


def counted(rate: CounterRate, *, hertz: float, until: float, read_every: float, since: float = 0.03) -> None:
    """Read the counter of a publisher of 10-byte messages that is steady since some time."""
    readings = int(until / read_every)
    for number in range(readings + 1):
        now = number * read_every
        messages = max(0, int((now - since) * hertz + 1e-9) + 1 if now >= since else 0)
        rate.add(now, messages, 10 * messages)


@pytest.mark.parametrize("hertz", [0.5, 1.0, 7.3, 30.0, 1000.0])
def test_a_counter_gives_the_rate(hertz: float) -> None:
    """Within one percent, without having heard a message."""
    rate = CounterRate()
    counted(rate, hertz=hertz, until=10.0, read_every=0.02)
    found = rate.rate()
    assert found is not None
    assert found.per_sec == pytest.approx(hertz, rel=0.01)
    assert found.window == pytest.approx(hertz * 10, rel=0.02, abs=2)


def test_a_counter_that_has_not_risen_twice_has_no_rate() -> None:
    """One message says nothing; what was counted before does not either."""
    rate = CounterRate()
    assert (rate.rate(), rate.traffic(), rate.begun) == (None, None, False)
    rate.add(0.0, 1_000_000, 1_000)
    rate.add(1.0, 1_000_000, 1_000)
    assert rate.rate() is None
    assert rate.traffic() == (0.0, 0, 0.0)
    rate.add(2.0, 1_000_001, 1_010)
    assert rate.rate() is None
    rate.add(2.5, 1_000_002, 1_030)
    assert rate.rate() == (2.0, 2)
    assert rate.traffic() == (12.0, 2, 15.0)


def test_the_window_of_a_counter_slides() -> None:
    """A change of pace is seen as soon as the window holds only the new one."""
    rate = CounterRate(20)
    for number in range(101):
        rate.add(number, number, number)
    for number in range(1, 31):
        rate.add(100 + number / 10, 100 + number, 100 + number)
    found = rate.rate()
    assert found is not None
    assert found.per_sec == pytest.approx(10)
    assert found.window == 21
    seen = rate.traffic()
    assert seen is not None
    assert seen.bytes_per_sec == pytest.approx(10)


def test_a_counter_that_begins_anew() -> None:
    """The topic was gone in between: what was before does not count, and nothing is negative."""
    rate = CounterRate()
    counted(rate, hertz=100, until=5, read_every=0.1)
    rate.add(6.0, 0, 0)
    assert (rate.rate(), rate.total) == (None, 0)
    rate.add(7.0, 5, 50)
    rate.add(8.0, 10, 100)
    assert rate.rate() == (5.0, 6)
    assert rate.traffic() == (50.0, 10, 10.0)


def test_bytes_fall_when_the_topic_is_silent() -> None:
    """The rate says how often messages came while they came, the traffic what comes now."""
    rate = CounterRate(2)
    counted(rate, hertz=10, until=2, read_every=0.1, since=0.0)
    rate.add(12.0, 21, 210)
    found, seen = rate.rate(), rate.traffic()
    assert found is not None
    assert seen is not None
    assert found.per_sec == pytest.approx(10)
    assert seen.bytes_per_sec < 10
