"""Drawings in DOT."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from actors.tools.graph_drawing.dot import dot_of
from actors.tools.graph_drawing.model import GraphFilter, model_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot


@pytest.mark.parametrize("nodes_only", [False, True], ids=["all", "nodes"])
def test_drawings(
    nodes_only: bool, graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """Vertices with labels, edges by their numbers."""
    model = model_of(graph("course"), GraphFilter(nodes_only=nodes_only))
    assert dot_of(model) == golden(f"course_{'nodes' if nodes_only else 'all'}.dot")


def test_names_stay_within_their_quotes(graph: Callable[[str], GraphSnapshot]) -> None:
    """Quotes, backslashes and line ends are escaped."""
    text = dot_of(model_of(graph('/"];evil[label="\\ >/x\x07')))
    labels = re.findall(r'label="((?:[^"\\]|\\.)*)", shape', text)
    assert labels == ['/\\"];evil[label=\\"\\\\', "/x\\\\x07"]
    assert all(line.count(";") <= 1 or "evil" in line for line in text.splitlines())


def test_edges_to_what_does_not_match_are_red(graph: Callable[[str], GraphSnapshot]) -> None:
    """Dashed, with a label; others are as usual."""
    lines = [line for line in dot_of(model_of(graph("mismatches"))).splitlines() if "->" in line]
    red = [line for line in lines if 'label="does not match", color="#c0392b"' in line]
    assert (len(red), len(lines)) == (4, 5)
    assert all("style=dashed" in line for line in red)
