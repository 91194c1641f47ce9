"""Routing between two columns of a text drawing, where lines change their row.

Each hub with wires here has one net: rows on the left and rows on the right, all joined. A net follows its
rows from the sides to a track, a column of characters, and there goes up and down. Nets never share a track
where they would touch, and a net that enters on a row from the left turns off before the net that leaves on
that row to the right. Where two nets contradict each other, one takes two tracks and a free row between.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


class Net(NamedTuple):
    """The rows that one hub's wires join in a channel.

    Attributes:
        hub: The index of the hub.
        left: Rows on the left side.
        right: Rows on the right side.
    """

    hub: int
    left: frozenset[int]
    right: frozenset[int]


class Branch(NamedTuple):
    """A horizontal piece of a net.

    Attributes:
        hub: The index of the hub.
        row: The row it is on.
        begin: The track on its left; -1 for the left side.
        end: The track on its right; None for the right side.
    """

    hub: int
    row: int
    begin: int
    end: int | None


class Trunk(NamedTuple):
    """A vertical piece of a net.

    Attributes:
        hub: The index of the hub.
        track: The track it is on.
        top, bottom: The rows between which it goes.
    """

    hub: int
    track: int
    top: int
    bottom: int


@dataclass(frozen=True, slots=True)
class Routes:
    """The routes of a channel's nets.

    Attributes:
        tracks: The number of tracks.
        branches: The horizontal pieces.
        trunks: The vertical pieces.
        rows: The rows that the drawing needs; more than before if none was free.
    """

    tracks: int
    branches: list[Branch]
    trunks: list[Trunk]
    rows: int


class _Piece(NamedTuple):
    """A net or half of one, which takes one track. `jog` is the row on which the halves meet."""

    net: Net
    left: frozenset[int]
    right: frozenset[int]
    jog: int | None = None

    @property
    def top(self) -> int:
        return min(self.left | self.right)

    @property
    def bottom(self) -> int:
        return max(self.left | self.right)


def routed(nets: Iterable[Net], rows: int) -> Routes:
    """Return the routes of a channel's nets.

    Args:
        nets: At most one for each row on either side.
        rows: The rows of the drawing.
    """
    straight: list[Net] = []
    pieces: list[_Piece] = []
    for net in nets:
        if len(net.left | net.right) == 1:
            straight.append(net)
        else:
            pieces.append(_Piece(net, net.left, net.right))
    taken = {row for net in straight for row in net.left}
    taken |= {row for piece in pieces for row in piece.left | piece.right}
    order = _sequence(pieces)
    while order is None:
        split = _in_cycle(pieces)
        jog = _free_row(pieces[split], taken, rows)
        taken.add(jog)
        rows = max(rows, jog + 1)
        net = pieces[split].net
        pieces[split : split + 1] = [
            _Piece(net, net.left, frozenset({jog}), jog),
            _Piece(net, frozenset({jog}), net.right, jog),
        ]
        order = _sequence(pieces)
    return _drawn([pieces[at] for at in _without_crossings(order, pieces)], straight, rows)


def _must_precede(first: _Piece, second: _Piece) -> bool:
    """Return whether a piece must turn off on the left of another."""
    if first.net is second.net:
        return first.jog in first.right
    return bool(first.left & second.right)


def _sequence(pieces: list[_Piece]) -> list[int] | None:
    """Return the pieces in an order that their rows allow; None if they contradict each other."""
    blockers = [
        {other for other in range(len(pieces)) if other != at and _must_precede(pieces[other], pieces[at])}
        for at in range(len(pieces))
    ]
    order: list[int] = []
    left = list(range(len(pieces)))
    while left:
        free = [at for at in left if not blockers[at] & set(left)]
        if not free:
            return None
        order += free
        left = [at for at in left if at not in free]
    return order


def _in_cycle(pieces: list[_Piece]) -> int:
    """Return a piece of a cycle of pieces that must each precede the next."""
    left = set(range(len(pieces)))
    while True:
        loose = {
            at
            for at in left
            if not any(other != at and _must_precede(pieces[other], pieces[at]) for other in left)
            or not any(other != at and _must_precede(pieces[at], pieces[other]) for other in left)
        }
        if not loose:
            return min(at for at in left if pieces[at].jog is None)
        left -= loose


def _free_row(piece: _Piece, taken: set[int], rows: int) -> int:
    """Return the unused row that is nearest to a piece."""
    middle = (piece.top + piece.bottom) // 2
    near = sorted(set(range(rows)) - taken, key=lambda row: (abs(row - middle), row))
    return near[0] if near else max(taken) + 1


def _without_crossings(order: list[int], pieces: list[_Piece]) -> list[int]:
    """Return the order after exchanging neighbours while that removes crossings."""
    for _ in range(len(order)):
        changed = False
        for at in range(len(order) - 1):
            first, second = pieces[order[at]], pieces[order[at + 1]]
            if not _must_precede(first, second) and _crossings(second, first) < _crossings(first, second):
                order[at], order[at + 1] = order[at + 1], order[at]
                changed = True
        if not changed:
            break
    return order


def _crossings(first: _Piece, second: _Piece) -> int:
    """Return how often two pieces cross if the first one's track is on the left."""
    return sum(second.top <= row <= second.bottom for row in first.right) + sum(
        first.top <= row <= first.bottom for row in second.left
    )


def _drawn(pieces: list[_Piece], straight: list[Net], rows: int) -> Routes:
    tracks: list[int] = []
    for at, piece in enumerate(pieces):
        beside = [
            tracks[other]
            for other in range(at)
            if pieces[other].top <= piece.bottom and piece.top <= pieces[other].bottom
        ]
        tracks.append(1 + max(beside, default=-1))
    branches = [Branch(net.hub, row, -1, None) for net in straight for row in net.left]
    trunks: list[Trunk] = []
    jogs = {piece.net.hub: tracks[at] for at, piece in enumerate(pieces) if piece.jog in piece.right}
    for piece, track in zip(pieces, tracks, strict=True):
        hub = piece.net.hub
        trunks.append(Trunk(hub, track, piece.top, piece.bottom))
        branches += [
            Branch(hub, row, jogs[hub] if row == piece.jog else -1, track) for row in sorted(piece.left)
        ]
        branches += [Branch(hub, row, track, None) for row in sorted(piece.right) if row != piece.jog]
    return Routes(1 + max(tracks, default=-1), branches, trunks, rows)
