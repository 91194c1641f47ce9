"""Counts of messages that do not reach a bag."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from actors.bags.recorder.losses import MAX_GAPS, MAX_PUBLISHERS, TopicCounts, losses_of


def test_gaps_and_drops_are_counted_by_publisher_and_number() -> None:
    """Messages that did not arrive are lost, others may be dropped; gaps list the numbers of both."""
    counts = TopicCounts()
    for number in (4, 5, 9, 10):
        counts.note(b"a", "/a", number)
    counts.drop(b"a", 10)
    counts.note(b"b", "/b", 0)
    assert counts.document(counts.lost()) == {
        "lost": 3,
        "dropped": 1,
        "invalid": 0,
        "publishers": {"/a": {"lost": 3, "dropped": 1, "gaps": [[6, 3], [10, 1]]}},
    }


def test_latched_messages_are_no_gap() -> None:
    """Latched messages may have lower numbers; counting continues where it was."""
    counts = TopicCounts()
    for number in (7, 3, 4, 8):
        counts.note(b"a", "/a", number)
    assert counts.lost() == 0


def test_losses_before_the_first_message_count_too() -> None:
    """The subscription knows of losses before the first message; gaps that it knows count once."""
    counts = TopicCounts()
    counts.note(b"a", "/a", 10)
    assert counts.lost(2) == 2
    counts.note(b"a", "/a", 12)
    assert counts.lost(2) == 2


def test_topics_that_lost_nothing_are_left_out() -> None:
    """Without losses, the document is empty."""
    whole, torn = TopicCounts(), TopicCounts()
    torn.invalid = 1
    found = losses_of({"/whole": whole, "/torn": torn}, {})
    assert found == {"/torn": {"lost": 0, "dropped": 0, "invalid": 1, "publishers": {}}}


def test_publishers_that_are_counted_by_themselves_are_limited() -> None:
    """Publishers and gaps that are listed are limited; the topic's counts include all."""
    counts = TopicCounts()
    for index in range(MAX_PUBLISHERS + 5):
        gid = str(index).encode()
        counts.note(gid, f"/n{index}", 0)
        counts.drop(gid, 0)
    assert counts.dropped == MAX_PUBLISHERS + 5
    assert len(counts.document(0)["publishers"]) == MAX_PUBLISHERS
    counts = TopicCounts()
    for index in range(0, 2 * (MAX_GAPS + 5), 2):
        counts.note(b"a", "/a", index)
    gaps = counts.document(counts.lost())["publishers"]["/a"]["gaps"]
    assert len(gaps) == MAX_GAPS
    assert gaps[-1] == [2 * (MAX_GAPS + 4) - 1, 1]


def test_nodes_of_one_name_are_told_apart() -> None:
    """Each publisher has its own entry, also if nodes share a name."""
    counts = TopicCounts()
    for gid in (b"a", b"b"):
        counts.note(gid, "/n", 0)
        counts.note(gid, "/n", 2)
    assert list(counts.document(2)["publishers"]) == ["/n", "/n (2)"]


@given(st.lists(st.sampled_from(["arrives", "lost", "dropped"]), min_size=1, max_size=60))
def test_every_number_ends_in_one_count(fates: list[str]) -> None:
    """The gaps list exactly the numbers that are missing between the first and the last arrival."""
    counts, missing, pending, begun = TopicCounts(), set[int](), set[int](), False
    for number, fate in enumerate(fates):
        if fate == "lost":
            if begun:
                pending.add(number)
            continue
        begun = True
        missing |= pending
        pending.clear()
        counts.note(b"a", "/a", number)
        if fate == "dropped":
            counts.drop(b"a", number)
            missing.add(number)
    document = counts.document(counts.lost())
    gaps: list[list[int]] = document["publishers"].get("/a", {"gaps": []})["gaps"] if document else []
    assert {first + each for first, count in gaps for each in range(count)} == missing
    assert counts.lost() + counts.dropped == len(missing)
