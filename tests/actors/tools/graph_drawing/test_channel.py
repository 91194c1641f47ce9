"""Lines between two columns."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from actors.tools.graph_drawing.channel import Net, routed


def net(hub: int, left: set[int], right: set[int]) -> Net:
    """Return a net."""
    return Net(hub, frozenset(left), frozenset(right))


def test_a_straight_line_needs_no_track() -> None:
    """One row, one branch."""
    routes = routed([net(0, {3}, {3})], 5)
    assert (routes.tracks, routes.trunks) == (0, [])
    assert [(branch.row, branch.begin, branch.end) for branch in routes.branches] == [(3, -1, None)]


def test_what_comes_in_turns_off_before_what_goes_out() -> None:
    """On a row that both use."""
    routes = routed([net(0, {0}, {2}), net(1, {2}, {4})], 5)
    track = {trunk.hub: trunk.track for trunk in routes.trunks}
    assert track[1] < track[0]


def test_nets_that_change_places_take_a_row_between() -> None:
    """Each forbids the other to be first; one goes round over a free row, and no row is added."""
    routes = routed([net(0, {0}, {2}), net(1, {2}, {0})], 3)
    assert routes.rows == 3
    assert sorted(trunk.hub for trunk in routes.trunks) == [0, 0, 1]
    assert 1 in {branch.row for branch in routes.branches}


def test_a_row_is_added_if_none_is_free() -> None:
    """Below all the others."""
    assert routed([net(0, {0}, {1}), net(1, {1}, {0})], 2).rows == 3


def test_lines_that_need_not_cross_do_not() -> None:
    """The lower of two that go down takes the track on the left."""
    routes = routed([net(0, {0}, {5}), net(1, {2}, {7})], 8)
    track = {trunk.hub: trunk.track for trunk in routes.trunks}
    assert track[1] < track[0]


def test_apart_they_share_a_track() -> None:
    """A channel is not wider than it must be."""
    assert routed([net(0, {0}, {2}), net(1, {4}, {6})], 8).tracks == 1


@st.composite
def channels(draw: st.DrawFn) -> list[Net]:
    """Return any nets: each row is one net's at most on either side."""
    rows = st.lists(st.integers(0, 6), min_size=12, max_size=12)
    lefts, rights = draw(rows), draw(rows)
    nets = [
        net(
            hub,
            {at for at, each in enumerate(lefts) if each == hub},
            {at for at, each in enumerate(rights) if each == hub},
        )
        for hub in range(6)
    ]
    return [each for each in nets if each.left and each.right]


@given(channels())
def test_nets_never_touch(nets: list[Net]) -> None:
    """Branches do not overlap, trunks do not overlap, and no branch ends on another net's trunk."""
    routes = routed(nets, 12)
    end = routes.tracks
    branches = [
        (branch.hub, branch.row, branch.begin, end if branch.end is None else branch.end)
        for branch in routes.branches
    ]
    for hub, row, begin, stop in branches:
        assert begin < stop
        for other, other_row, other_begin, other_stop in branches:
            if other != hub and other_row == row:
                assert stop < other_begin or other_stop < begin
        for trunk in routes.trunks:
            if trunk.hub != hub and trunk.top <= row <= trunk.bottom:
                assert trunk.track not in {begin, stop}
    for at, one in enumerate(routes.trunks):
        for two in routes.trunks[at + 1 :]:
            assert one.track != two.track or one.bottom < two.top or two.bottom < one.top


@given(channels())
def test_nets_reach_their_rows(nets: list[Net]) -> None:
    """All on both sides, and the row of a trunk's end is one where a branch meets it."""
    routes = routed(nets, 12)
    for each in nets:
        branches = [branch for branch in routes.branches if branch.hub == each.hub]
        assert {branch.row for branch in branches if branch.begin == -1} == each.left
        assert {branch.row for branch in branches if branch.end is None} == each.right
        for trunk in routes.trunks:
            if trunk.hub == each.hub:
                met = {branch.row for branch in branches if trunk.track in {branch.begin, branch.end}}
                assert {trunk.top, trunk.bottom} <= met
