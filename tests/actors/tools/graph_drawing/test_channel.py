"""Lines between two columns."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from actors.tools.graph_drawing.channel import Net, routed


def net(hub: int, left: set[int], right: set[int]) -> Net:
    """Return a net."""
    return Net(hub, frozenset(left), frozenset(right))


def test_a_straight_line_needs_no_track() -> None:
    """One row, one run."""
    routes = routed([net(0, {3}, {3})], 5)
    assert (routes.tracks, routes.trunks) == (0, [])
    assert [(run.row, run.begin, run.end) for run in routes.runs] == [(3, -1, None)]


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
    assert 1 in {run.row for run in routes.runs}


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


@settings(deadline=None)
@given(channels())
def test_nets_never_touch(nets: list[Net]) -> None:
    """No two runs share a spot of a row, no two trunks one of a track, and no run ends on another's trunk."""
    routes = routed(nets, 12)
    end = routes.tracks
    runs = [(run.hub, run.row, run.begin, end if run.end is None else run.end) for run in routes.runs]
    for hub, row, begin, stop in runs:
        assert begin < stop
        for other, other_row, other_begin, other_stop in runs:
            if other != hub and other_row == row:
                assert stop < other_begin or other_stop < begin
        for trunk in routes.trunks:
            if trunk.hub != hub and trunk.top <= row <= trunk.bottom:
                assert trunk.track not in {begin, stop}
    for at, one in enumerate(routes.trunks):
        for two in routes.trunks[at + 1 :]:
            assert one.track != two.track or one.bottom < two.top or two.bottom < one.top


@settings(deadline=None)
@given(channels())
def test_nets_reach_their_rows(nets: list[Net]) -> None:
    """All on both sides, and the row of a trunk's end is one where a run meets it."""
    routes = routed(nets, 12)
    for each in nets:
        runs = [run for run in routes.runs if run.hub == each.hub]
        assert {run.row for run in runs if run.begin == -1} == each.left
        assert {run.row for run in runs if run.end is None} == each.right
        for trunk in routes.trunks:
            if trunk.hub == each.hub:
                met = {run.row for run in runs if trunk.track in {run.begin, run.end}}
                assert {trunk.top, trunk.bottom} <= met
