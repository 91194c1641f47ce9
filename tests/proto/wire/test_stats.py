"""Broker statistics: rates, and totals of other versions."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import pytest

from proto import limits
from proto.wire.stats import TOTALS, BrokerRates, BrokerStats, increase


def test_rates_are_differences_over_time() -> None:
    """The increase of every total is divided by the time between the snapshots."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0, routed=100, bytes_sent=7, queued=3)
    rates = replace(earlier, stamp_sec=14.0, routed=300, bytes_sent=9, queued=900).rates_since(earlier)
    assert (rates.interval_sec, rates.routed, rates.bytes_sent) == (4.0, 50.0, 0.5)
    others = {name: rate for name, rate in rates.as_dict().items() if rate}
    assert set(others) == {"interval_sec", "seconds", "routed", "bytes_sent"}


def test_the_former_name_of_the_interval_warns() -> None:
    """As an attribute; documents have both, for programs that read them."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0)
    rates = replace(earlier, stamp_sec=14.0).rates_since(earlier)
    with pytest.warns(
        DeprecationWarning, match="BrokerRates.seconds is called BrokerRates.interval_sec"
    ) as c:
        assert rates.seconds == rates.interval_sec
    assert c[0].filename == __file__
    document = rates.as_dict()
    assert document["seconds"] == document["interval_sec"] == 4.0


@pytest.mark.parametrize("smaller", [{"routed": 40}, {"uptime_sec": 1.0, "routed": 400}])
def test_a_broker_that_was_stopped_and_started_counts_from_zero(smaller: dict[str, Any]) -> None:
    """A smaller total, or a shorter uptime, means that all counts started again."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0, uptime_sec=5.0, routed=100, calls=10)
    again = replace(earlier, stamp_sec=14.0, uptime_sec=9.0, calls=12)
    rates = replace(again, **smaller).rates_since(earlier)
    assert (rates.routed, rates.calls) == (smaller["routed"] / 4, 3.0)
    assert min(rates.as_dict().values()) == 0


def test_a_total_that_may_decrease_is_no_restart() -> None:
    """Lost messages may arrive after all: that increase is zero, the others are differences."""
    before = SimpleNamespace(received=100, lost_on_break=7)
    after = SimpleNamespace(received=104, lost_on_break=5)
    assert increase(("received", "lost_on_break"), before, after) == {"received": 4, "lost_on_break": 0}
    assert increase(("received", "lost_on_break"), None, after) == {"received": 104, "lost_on_break": 5}


def test_rates_have_the_totals_names() -> None:
    """Each total has a rate."""
    assert tuple(field.name for field in fields(BrokerRates)) == ("interval_sec", *TOTALS)


@pytest.mark.parametrize("change", [{"stamp_sec": 10.0}, {"stamp_sec": 9.0}, {"broker": "bb"}])
def test_rates_need_an_earlier_snapshot_of_the_same_broker(change: dict[str, Any]) -> None:
    """The same moment, an earlier one and another broker have no rates."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0)
    with pytest.raises(ValueError, match="an earlier snapshot of the same broker"):
        replace(replace(earlier, stamp_sec=11.0), **change).rates_since(earlier)


def test_statistics_survive_a_map() -> None:
    """They are unchanged by the wire's map and by JSON."""
    stats = BrokerStats(broker="aa", stamp_sec=1.5, connections=3, dropped=4)
    totals = stats.as_dict()
    assert len(totals) <= limits.MAX_HEADER_MAP
    assert BrokerStats.from_map(totals) == stats
    assert BrokerStats.from_map(json.loads(json.dumps(totals))) == stats


def test_unknown_statistics_of_another_version_are_ignored() -> None:
    """Unknown names and wrong types are ignored, and missing ones have their default."""
    totals = {"connections": 3, "news": 4, "dropped": "many", "stamp_sec": None, "calls": True}
    assert BrokerStats.from_map(totals) == BrokerStats(connections=3)
