"""The room between two columns of a drawing of text, where lines change their row.

Each hub whose wires pass here has one net: rows on the left, rows on the right, and all of them joined. A net
runs on its rows from the sides to a track, which is a column of characters, and there up and down. Nets never
share a track where they would touch, and what comes in on a row from the left turns off before what goes out
on that row to the right. Where rows forbid each other, a net takes two tracks and a free row between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


class Net(NamedTuple):
    """What one hub's wires join in a channel: rows on its left side and on its right side."""

    hub: int
    left: frozenset[int]
    right: frozenset[int]


class Run(NamedTuple):
    """A stretch on a row, from one track to another. Track -1 is the left side, None the right one."""

    hub: int
    row: int
    begin: int
    end: int | None


class Trunk(NamedTuple):
    """A stretch on a track, from a row down to another."""

    hub: int
    track: int
    top: int
    bottom: int


@dataclass(frozen=True, slots=True)
class Routes:
    """How a channel's nets run."""

    tracks: int
    runs: list[Run]
    trunks: list[Trunk]
    rows: int
    """How many rows the drawing needs; more than before if no row was free."""


class _Piece(NamedTuple):
    """A net or half of one: it takes one track. `jog` is the row on which the halves meet."""

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
    """Return how the nets of a channel run, in a drawing of so many rows.

    Each row is one net's at most on either side.
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
        split = _in_circle(pieces)
        jog = _free_row(pieces[split], taken, rows)
        taken.add(jog)
        rows = max(rows, jog + 1)
        net = pieces[split].net
        pieces[split : split + 1] = [
            _Piece(net, net.left, frozenset({jog}), jog),
            _Piece(net, frozenset({jog}), net.right, jog),
        ]
        order = _sequence(pieces)
    return _drawn([pieces[at] for at in _calmed(order, pieces)], straight, rows)


def _must_precede(first: _Piece, second: _Piece) -> bool:
    """Tell whether a piece has to turn off on the left of another."""
    if first.net is second.net:
        return first.jog in first.right
    return bool(first.left & second.right)


def _sequence(pieces: list[_Piece]) -> list[int] | None:
    """Return the pieces in an order that their rows allow; None if they forbid each other."""
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


def _in_circle(pieces: list[_Piece]) -> int:
    """Return a piece whose rows forbid another's and are forbidden by it, perhaps by way of others."""
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
    """Return a row that nothing in the channel uses, as near to a piece as there is."""
    middle = (piece.top + piece.bottom) // 2
    near = sorted(set(range(rows)) - taken, key=lambda row: (abs(row - middle), row))
    return near[0] if near else max(taken) + 1


def _calmed(order: list[int], pieces: list[_Piece]) -> list[int]:
    """Return the order with neighbours changed as long as that takes crossings away."""
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
    runs = [Run(net.hub, row, -1, None) for net in straight for row in net.left]
    trunks: list[Trunk] = []
    jogs = {piece.net.hub: tracks[at] for at, piece in enumerate(pieces) if piece.jog in piece.right}
    for piece, track in zip(pieces, tracks, strict=True):
        hub = piece.net.hub
        trunks.append(Trunk(hub, track, piece.top, piece.bottom))
        runs += [Run(hub, row, jogs[hub] if row == piece.jog else -1, track) for row in sorted(piece.left)]
        runs += [Run(hub, row, track, None) for row in sorted(piece.right) if row != piece.jog]
    return Routes(1 + max(tracks, default=-1), runs, trunks, rows)
