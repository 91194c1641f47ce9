"""Drawings in characters."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from actors.tools.graph_drawing import text as text_module
from actors.tools.graph_drawing.model import GraphFilter, model_of
from actors.tools.graph_drawing.text import listing_of, text_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot


@pytest.mark.parametrize("name", ["course", "circle", "robot", "empty"])
@pytest.mark.parametrize("nodes_only", [False, True], ids=["all", "nodes"])
def test_drawings(
    name: str, nodes_only: bool, graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """They look as they have been looked at."""
    model = model_of(graph(name), GraphFilter(nodes_only=nodes_only))
    assert text_of(model) == golden(f"{name}_{'nodes' if nodes_only else 'all'}.txt")


@pytest.mark.parametrize("width", [95, 130])
def test_a_drawing_is_folded_until_it_fits(
    width: int, graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """It is as wide as there are columns at most, and shows all names all the same."""
    model = model_of(graph("robot"))
    text = text_of(model, width=width)
    assert text == golden(f"robot_{width}.txt")
    assert max(map(len, text.splitlines())) <= width
    assert all(vertex.name in text for vertex in model.vertices)


def test_what_does_not_fit_is_listed(graph: Callable[[str], GraphSnapshot]) -> None:
    """Whatever the width, also if the one thing that is too wide is a node without a topic."""
    model = model_of(graph("course"))
    assert text_of(model, width=40) == listing_of(model)
    lonely = model_of(graph("/a_node_with_quite_a_name"))
    assert text_of(lonely, width=20) == "/a_node_with_quite_a_name"
    assert "╭" in text_of(lonely, width=40)


def test_what_is_too_large_is_listed(
    graph: Callable[[str], GraphSnapshot], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lines of very many nodes cannot be followed."""
    model = model_of(graph("circle"))
    monkeypatch.setattr(text_module, "MAX_DRAWN", len(model.vertices))
    assert "╭" in text_of(model)
    monkeypatch.setattr(text_module, "MAX_DRAWN", len(model.vertices) - 1)
    assert text_of(model) == listing_of(model)


def test_too_many_lines_are_listed(
    graph: Callable[[str], GraphSnapshot], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of few nodes: each arrow from node to node has a label, which takes the place of a vertex."""
    names = [f"/n{number:02}" for number in range(25)]
    mesh = graph("\n".join(f"{name} >/x </x" for name in names))
    assert "╭" in text_of(model_of(mesh))
    direct = model_of(mesh, GraphFilter(nodes_only=True))
    assert len(direct.vertices) == 25
    assert text_of(direct) == listing_of(direct)
    monkeypatch.setattr(text_module, "MAX_DRAWN_EDGES", 49)
    assert text_of(model_of(mesh)) == listing_of(model_of(mesh))


def test_listing(graph: Callable[[str], GraphSnapshot]) -> None:
    """Each node, and what it does."""
    drawn = graph("/a >/x ?/s\n/b </x !/s\n/c")
    assert listing_of(model_of(drawn)).splitlines() == [
        "/a",
        "  calls /s",
        "  publishes /x",
        "/b",
        "  serves /s",
        "  subscribes /x",
        "/c",
    ]
    assert listing_of(model_of(drawn, GraphFilter(nodes_only=True))).splitlines() == [
        "/a",
        "  calls /s of /b",
        "  publishes /x to /b",
        "/b",
        "/c",
    ]


def test_ascii(graph: Callable[[str], GraphSnapshot]) -> None:
    """The same drawing without box characters."""
    model = model_of(graph("robot"))
    plain, boxed = text_of(model, ascii_only=True), text_of(model)
    assert plain.isascii()
    assert [len(line) for line in plain.splitlines()] == [len(line) for line in boxed.splitlines()]
    assert "| /lidar  +--> /scan" in plain


def test_color_changes_no_character(graph: Callable[[str], GraphSnapshot]) -> None:
    """A topic's lines have its colour, whichever of its sides they are on; every line ends plain."""
    model = model_of(graph("robot"))
    colored = text_of(model, color=True)
    assert re.sub("\x1b\\[[0-9;]*m", "", colored) == text_of(model)
    assert all(line.rfind("\x1b[0m") == line.rfind("\x1b") for line in colored.splitlines() if line)


def test_names_are_sanitized(graph: Callable[[str], GraphSnapshot]) -> None:
    """They are escaped, and boxes have room for what they become."""
    text = text_of(model_of(graph("/a\x1b[2J >/\u202ex\n/ü漢")))
    assert "\x1b" not in text
    assert "\u202e" not in text
    lines = text.splitlines()
    assert "│ /a\\x1b[2J ├──▶ /\\u202ex" in text
    assert len({len(lines[0]), len(lines[2])}) == 1


def test_nodes_that_do_not_match_are_crossed(
    graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """In red, at both ends; in ASCII by an x; in a listing by words."""
    model = model_of(graph("mismatches"))
    assert text_of(model) == golden("mismatches_all.txt")
    assert len(re.findall("\x1b\\[(0;)?31m✗", text_of(model, color=True))) == 4
    assert "+x-> /x" in text_of(model, ascii_only=True)
    assert listing_of(model).splitlines()[:2] == ["/a", "  publishes /x (does not match)"]
