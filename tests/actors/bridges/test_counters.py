"""What a bridge counts."""

from __future__ import annotations

import json

from actors.bridges.counters import MAX_DETAIL, MAX_FAILURES, MAX_REASONS, MAX_ROWS, OTHER, Counters, Counts
from actors.bridges.report import Reason, Refusal


def test_counts_go_on_when_a_topic_comes_back() -> None:
    """By name, type and direction."""
    counters = Counters()
    counters.topic("/t", "a/msg/B", from_theirs=True).received += 2
    counters.topic("/t", "a/msg/B", from_theirs=False).received += 5
    assert counters.topic("/t", "a/msg/B", from_theirs=True).received == 2


def test_reasons_and_examples_have_limits() -> None:
    """Reasons beyond it count as other ones; examples are cut."""
    counts = Counts()
    for number in range(MAX_REASONS + 5):
        counts.drop(f"reason {number}", "x" * 1000)
    assert counts.dropped[OTHER] == 5
    assert counts.dropped.total() == MAX_REASONS + 5
    assert {len(each) for each in counts.examples.values()} == {MAX_DETAIL}


def test_the_oldest_names_are_forgotten_beyond_a_limit() -> None:
    """Names may be made up for every client."""
    counters = Counters()
    for number in range(MAX_ROWS + 1):
        counters.service(f"/s{number}", from_theirs=True).received += 1
    names = [row["name"] for row in counters.document()["services"]]
    assert len(names) == MAX_ROWS
    assert "/s0" not in names
    assert f"/s{MAX_ROWS}" in names


def test_news_are_told_once() -> None:
    """A refusal is new again after it has gone; a failure is new once."""
    counters = Counters()
    refusal = Refusal("/t", Reason.SECOND_TYPE, "it has two")
    assert counters.refuse((refusal,)) == [refusal]
    assert counters.refuse((refusal,)) == []
    assert counters.refuse(()) == []
    assert counters.refuse((refusal,)) == [refusal]
    assert [counters.failed("no") for _ in range(2)] == [True, False]
    for number in range(MAX_FAILURES + 1):
        counters.failed(str(number))
    assert len(counters.document()["failures"]) == MAX_FAILURES


def test_a_type_that_is_missing_is_told_once() -> None:
    """Whatever the number of topics with the type, also those that come later."""
    counters = Counters()
    refusals = [Refusal(f"/t{number}", Reason.TYPE_MISSING, "install it", "a/msg/B") for number in range(3)]
    assert counters.refuse((*refusals[:2],)) == refusals[:1]
    assert counters.refuse((*refusals,)) == []
    assert len(counters.document()["refusals"]) == 3


def test_the_document_is_json() -> None:
    """With all counts of topics and calls."""
    counters = Counters()
    counters.topic("/t", "a/msg/B", from_theirs=True).drop("invalid", "it is bad")
    calls = counters.service("/s", from_theirs=False)
    calls.sent += 1
    calls.drop("late")
    counters.refuse((Refusal("/t", Reason.TYPE_MISSING, "install it", "a/msg/B"),))
    document = json.loads(json.dumps(counters.document()))
    assert document["topics"][0]["dropped"] == {"invalid": 1}
    assert document["services"][0]["sent"] == 1
    assert document["refusals"][0]["text"] == "install it"
