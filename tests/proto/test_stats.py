"""A broker's numbers as data: rates, and what another version sends."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import pytest

from proto import limits
from proto.stats import TOTALS, BrokerRates, BrokerStats, increase


def test_rates_are_differences_over_time() -> None:
    """Every total is divided by the time between the looks, whatever came before."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0, routed=100, bytes_sent=7, queued=3)
    rates = replace(earlier, stamp_sec=14.0, routed=300, bytes_sent=9, queued=900).rates_since(earlier)
    assert (rates.seconds, rates.routed, rates.bytes_sent) == (4.0, 50.0, 0.5)
    others = {name: rate for name, rate in rates.as_dict().items() if rate}
    assert set(others) == {"seconds", "routed", "bytes_sent"}


@pytest.mark.parametrize("smaller", [{"routed": 40}, {"uptime_sec": 1.0, "routed": 400}])
def test_a_broker_that_was_stopped_and_started_counts_from_zero(smaller: dict[str, Any]) -> None:
    """No rate is negative: a smaller total, or a shorter time since the start, says that all began anew."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0, uptime_sec=5.0, routed=100, calls=10)
    again = replace(earlier, stamp_sec=14.0, uptime_sec=9.0, calls=12)
    rates = replace(again, **smaller).rates_since(earlier)
    assert (rates.routed, rates.calls) == (smaller["routed"] / 4, 3.0)
    assert min(rates.as_dict().values()) == 0


def test_what_is_found_again_is_no_new_beginning() -> None:
    """Messages lost on a break may come after all: that rate is zero, and the others are differences."""
    before = SimpleNamespace(received=100, lost_on_break=7)
    after = SimpleNamespace(received=104, lost_on_break=5)
    assert increase(("received", "lost_on_break"), before, after) == {"received": 4, "lost_on_break": 0}
    assert increase(("received", "lost_on_break"), None, after) == {"received": 104, "lost_on_break": 5}


def test_rates_have_the_totals_names() -> None:
    """What adds up in the numbers is what rates tell."""
    assert tuple(field.name for field in fields(BrokerRates)) == ("seconds", *TOTALS)


@pytest.mark.parametrize("change", [{"stamp_sec": 10.0}, {"stamp_sec": 9.0}, {"broker": "bb"}])
def test_rates_need_an_earlier_look_at_the_same_broker(change: dict[str, Any]) -> None:
    """The same moment, an earlier one and another broker have no rates."""
    earlier = BrokerStats(broker="aa", stamp_sec=10.0)
    with pytest.raises(ValueError, match="an earlier look at the same broker"):
        replace(replace(earlier, stamp_sec=11.0), **change).rates_since(earlier)


def test_numbers_go_through_a_map_unchanged() -> None:
    """They fit the wire's map, and JSON."""
    stats = BrokerStats(broker="aa", stamp_sec=1.5, connections=3, dropped=4)
    totals = stats.as_dict()
    assert len(totals) <= limits.MAX_HEADER_MAP
    assert BrokerStats.from_map(totals) == stats
    assert BrokerStats.from_map(json.loads(json.dumps(totals))) == stats


def test_another_versions_numbers_are_taken_as_far_as_they_are_known() -> None:
    """New names, missing ones and wrong types do no harm."""
    totals = {"connections": 3, "news": 4, "dropped": "many", "stamp_sec": None, "calls": True}
    assert BrokerStats.from_map(totals) == BrokerStats(connections=3)
