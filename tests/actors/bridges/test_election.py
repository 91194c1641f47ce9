"""Which of several bridges is active."""

from __future__ import annotations

import pytest

from actors.bridges.election import ACTIVE, SETTLE_SEC, START_SEC, Election, bridges_in
from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_LABEL, BRIDGE_STATE_LABEL, ORIGIN_LABEL

NOW = 100.0


def test_a_bridge_alone_is_active() -> None:
    """Without another bridge nobody is waited for, and its own node is no rival."""
    election = Election("b", start_sec=0)
    assert not election.active
    assert election.update(NOW, {"b": False}, {"b"})
    assert election.active
    assert not election.waits_for


def test_a_bridge_looks_before_it_is_active() -> None:
    """Two bridges that start at once may not see each other yet: each waits a moment."""
    election = Election("b")
    for now in (NOW, NOW + 100):
        assert not election.update(now, {}, set())
        assert not election.waits_for
        assert election.update(now + START_SEC, {}, set())
        election.disconnect()


def test_a_bridge_waits_for_the_active_one() -> None:
    """The active bridge stays active, whatever the ids; the other one says for which it waits."""
    election = Election("a", start_sec=0)
    assert not election.update(NOW, {"a": False, "b": True}, {"a", "b"})
    assert not election.update(NOW + 100, {"b": True}, {"b"})
    assert election.waits_for == "b"
    active = Election("b", start_sec=0)
    active.update(NOW, {}, set())
    assert active.update(NOW, {"a": False}, {"a"})


def test_a_bridge_takes_over_as_soon_as_callboard_misses_the_active_one() -> None:
    """A killed bridge leaves callboard's graph at once; what ROS still shows of it does not count."""
    election = Election("b", start_sec=0)
    election.update(NOW, {"a": True}, {"a"})
    assert not election.update(NOW + 50, {"a": True}, {"a"})
    assert election.update(NOW + 50.1, {}, {"a"})


def test_the_smallest_id_takes_over() -> None:
    """Of two that wait for one that is killed, one takes over, and the other one sees it."""
    here = {"a": True, "b": False, "c": False}
    b, c = Election("b", start_sec=0), Election("c", start_sec=0)
    for each in (b, c):
        assert not each.update(NOW, here, set(here))
        assert not each.update(NOW + 50, here, set(here))
    del here["a"]
    assert b.update(NOW + 51, here, {"a", "b", "c"})
    assert not c.update(NOW + 51, here, {"a", "b", "c"})
    assert c.waits_for == "b"


def test_two_that_start_at_once_do_not_both_become_active() -> None:
    """A bridge that has just come may be active before its marker is seen: that is waited for."""
    first, second = Election("b", start_sec=0), Election("a", start_sec=0)
    assert first.update(NOW, {}, set())
    assert not second.update(NOW, {"b": False}, {"b"})
    assert not second.update(NOW + 1, {"b": True}, {"b"})
    assert not second.update(NOW + 2 * SETTLE_SEC, {"b": True}, {"b"})
    other = Election("a", start_sec=0)
    assert not other.update(NOW, {"b": False}, {"b"})
    assert other.update(NOW + SETTLE_SEC, {"b": False}, {"b"})


def test_networks_of_one_name_that_do_not_touch() -> None:
    """A bridge that only callboard shows is waited for until it settles; then both are active."""
    election = Election("b", start_sec=0)
    assert not election.update(NOW, {"a": True}, set())
    assert not election.update(NOW + SETTLE_SEC - 0.1, {"a": True}, set())
    assert election.update(NOW + SETTLE_SEC, {"a": True}, set())
    assert election.update(NOW + SETTLE_SEC + 1, {"a": True}, set())


def test_a_rival_that_the_other_network_shows_late() -> None:
    """Discovery may be late: a bridge is a rival as soon as both sides show it."""
    election = Election("b", start_sec=0)
    assert not election.update(NOW, {"a": True}, set())
    assert not election.update(NOW + 1, {"a": True}, {"a"})
    assert not election.update(NOW + 60, {"a": True}, {"a"})


def test_a_rival_that_the_other_network_misses_for_a_moment() -> None:
    """The other network may lose sight of a rival: that settles first, however long it was known."""
    election = Election("b", start_sec=0)
    election.update(NOW, {"a": True}, {"a"})
    assert not election.update(NOW + 60, {"a": True}, set())
    assert not election.update(NOW + 61, {"a": True}, {"a"})
    assert not election.update(NOW + 70, {"a": True}, set())
    assert election.update(NOW + 70 + SETTLE_SEC, {"a": True}, set())


@pytest.mark.parametrize("own", ["a", "b"])
def test_when_networks_meet_one_of_two_active_bridges_goes_on(own: str) -> None:
    """Both see that both are active: the one with the larger id stops."""
    other = "b" if own == "a" else "a"
    election = Election(own, start_sec=0)
    election.update(NOW, {}, set())
    assert election.update(NOW + 1, {other: True}, set())
    assert election.update(NOW + 2, {other: True}, {other}) is (own == "a")
    assert election.waits_for == ("" if own == "a" else other)


def test_a_bridge_that_was_cut_off_is_not_active_when_it_is_back() -> None:
    """Another one has taken over meanwhile."""
    election = Election("a", start_sec=0)
    election.update(NOW, {}, set())
    election.disconnect()
    assert not election.active
    assert not election.update(NOW + 10, {"b": True}, {"b"})
    election.disconnect()
    assert election.update(NOW + 20, {}, {"b"})


def test_bridges_are_known_by_their_labels() -> None:
    """Nodes with the labels for this network count; one of a bridge's says that it is active."""
    labels = [
        {BRIDGE_LABEL: "ros2/7", BRIDGE_ID_LABEL: "a"},
        {BRIDGE_LABEL: "ros2/7", BRIDGE_ID_LABEL: "a", BRIDGE_STATE_LABEL: ACTIVE},
        {BRIDGE_LABEL: "ros2/7", BRIDGE_ID_LABEL: "b", BRIDGE_STATE_LABEL: "?"},
        {BRIDGE_LABEL: "ros2/8", BRIDGE_ID_LABEL: "c"},
        {ORIGIN_LABEL: "ros2/7"},
        {BRIDGE_LABEL: "ros2/7"},
    ]
    assert bridges_in(labels, "ros2/7") == bridges_in(reversed(labels), "ros2/7") == {"a": True, "b": False}
