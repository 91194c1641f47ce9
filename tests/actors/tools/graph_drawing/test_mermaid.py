"""Drawings in Mermaid."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from actors.tools.graph_drawing.mermaid import mermaid_of
from actors.tools.graph_drawing.model import GraphFilter, model_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot


@pytest.mark.parametrize("nodes_only", [False, True], ids=["all", "nodes"])
def test_drawings(
    nodes_only: bool, graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """Vertices with shapes, edges by their numbers."""
    model = model_of(graph("course"), GraphFilter(nodes_only=nodes_only))
    assert mermaid_of(model) == golden(f"course_{'nodes' if nodes_only else 'all'}.mmd")


def test_names_stay_within_their_quotes(graph: Callable[[str], GraphSnapshot]) -> None:
    """What means something to Mermaid, or to the HTML that it makes, becomes a number."""
    (line,) = [each for each in mermaid_of(model_of(graph('/"<b>`#x\\;%%'))).splitlines() if "/" in each]
    label = re.fullmatch(r'  node0\(\["([^"]*)"\]\):::nodes', line)
    assert label is not None
    assert re.sub(r"#(\d+);", lambda code: chr(int(code[1])), label[1]) == '/"<b>`#x\\;%%'
    assert not set(re.sub(r"#\d+;", "", label[1])) & set('"<>`#\\;%')


def test_edges_to_what_does_not_match_are_red(graph: Callable[[str], GraphSnapshot]) -> None:
    """The style names them by their numbers."""
    lines = mermaid_of(model_of(graph("mismatches"))).splitlines()
    edges = [line for line in lines if "->" in line]
    red = [at for at, line in enumerate(edges) if "does not match" in line]
    assert len(red) == len(edges) - 1
    assert f"  linkStyle {','.join(map(str, red))} stroke:#c0392b,color:#c0392b,stroke-dasharray:4" in lines
