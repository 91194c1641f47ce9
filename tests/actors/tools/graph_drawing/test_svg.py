"""Drawings as SVG."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import pytest

from actors.tools.graph_drawing import svg as svg_module
from actors.tools.graph_drawing.model import DrawingTooLargeError, GraphFilter, GraphModel, Kind, model_of
from actors.tools.graph_drawing.svg import svg_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot

SVG = "{http://www.w3.org/2000/svg}"


def shapes(text: str, kind: str) -> dict[str, tuple[float, float, float, float]]:
    """Return the boxes of a kind by their names: left, top, right, bottom, within their part."""
    found: dict[str, tuple[float, float, float, float]] = {}
    for group in ET.fromstring(text).iter(f"{SVG}g"):
        rect, label = group.find(f"{SVG}rect"), group.find(f"{SVG}text")
        if group.get("class") == kind and rect is not None and label is not None and label.get("y"):
            left, top, width, height = (float(rect.get(each, "0")) for each in ("x", "y", "width", "height"))
            found[str(label.text)] = (left, top, left + width, top + height)
    return found


@pytest.mark.parametrize("nodes_only", [False, True], ids=["all", "nodes"])
def test_drawings(
    nodes_only: bool, graph: Callable[[str], GraphSnapshot], golden: Callable[[str], str]
) -> None:
    """They look as they have been looked at."""
    model = model_of(graph("course"), GraphFilter(nodes_only=nodes_only))
    assert svg_of(model) == golden(f"course_{'nodes' if nodes_only else 'all'}.svg")


@pytest.mark.parametrize("name", ["course", "circle", "robot", "empty"])
def test_everything_is_there_once(name: str, graph: Callable[[str], GraphSnapshot]) -> None:
    """The picture is XML with each name once, and its description has the numbers for screen readers."""
    model = model_of(graph(name))
    root = ET.fromstring(svg_of(model))
    labels = [label.text for label in root.iter(f"{SVG}text") if label.get("y")]
    assert sorted(map(str, labels)) == sorted(each.name for each in model.vertices) or labels == ["no nodes"]
    told = root.find(f"{SVG}desc")
    assert told is not None
    assert str(told.text).startswith(f"{len(model.of_kind(Kind.NODE))} node")


def test_boxes_do_not_overlap(graph: Callable[[str], GraphSnapshot]) -> None:
    """Those of the nodes and topics of a connected graph, and they are within the picture."""
    text = svg_of(model_of(graph("robot"), GraphFilter(services=False)))
    boxes = shapes(text, "node") | shapes(text, "topic")
    loose = {"/logger", "/watchdog", "/model_server", "/plan_server"}
    placed = [box for name, box in boxes.items() if name not in loose]
    assert len(placed) > 15
    for at, one in enumerate(placed):
        for other in placed[at + 1 :]:
            apart = one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
            assert apart
    width = float(ET.fromstring(text).get("width", "0"))
    assert all(box[0] >= 0 and box[2] <= width for box in placed)


def test_names_are_escaped(graph: Callable[[str], GraphSnapshot]) -> None:
    """Whatever they are, they are texts: no markup, and nothing that XML forbids."""
    text = svg_of(model_of(graph("/<script>&\"' >/]]>\x00\ud800\n/\uffff")))
    labels = {label.text for label in ET.fromstring(text).iter(f"{SVG}text")}
    assert "/<script>&\"'" in labels
    assert "<script" not in text


def test_types_are_told_at_a_topic(graph: Callable[[str], GraphSnapshot]) -> None:
    """By a title, which a browser shows where one points."""
    assert "<title>/x [example_msgs/msg/Message]</title>" in svg_of(model_of(graph("/a >/x")))


def test_a_long_chain_is_folded(graph: Callable[[str], GraphSnapshot]) -> None:
    """A picture is not wider than what can be looked at."""
    chain = "\n".join(f"/node_number_{at} </topic_{at} >/topic_{at + 1}" for at in range(12))
    width = re.search(r' width="([\d.]+)"', svg_of(model_of(graph(chain))))
    assert width is not None
    assert float(width[1]) < 1700


def test_the_legend_shows_what_is_there(graph: Callable[[str], GraphSnapshot]) -> None:
    """No service, no sample of one."""
    text = svg_of(model_of(graph("/a >/x")))
    assert '<text x="30">topic</text>' in text
    assert '<text x="30">service</text>' not in text


def test_too_much_is_refused(graph: Callable[[str], GraphSnapshot], monkeypatch: pytest.MonkeyPatch) -> None:
    """Before it is laid out."""
    model = model_of(graph("/a >/x"))
    monkeypatch.setattr(svg_module, "MAX_DRAWN", 2)
    assert svg_of(model)
    monkeypatch.setattr(svg_module, "MAX_DRAWN", 1)
    with pytest.raises(DrawingTooLargeError, match="2 nodes, topics and services are too many"):
        svg_of(model)


def test_an_empty_model_says_so() -> None:
    """An empty picture would look like a mistake."""
    assert ">no nodes</text>" in svg_of(GraphModel())


def test_colours_need_no_browser(graph: Callable[[str], GraphSnapshot]) -> None:
    """Renderers that know neither `var()` nor `@media` find a literal colour for each shape."""
    style = ET.fromstring(svg_of(model_of(graph("course")))).findtext(f"{SVG}style") or ""
    assert "var(" not in style
    plain = style.partition("@media")[0]
    for shape in (".paper", "text", ".node rect", ".topic .shape", ".service .shape", ".service .head"):
        assert re.search(rf"\.callboard {shape}[^{{}}]*{{[^}}]*fill: #[0-9a-f]{{6}}", plain), shape
    for line in (".node rect", ".topic .wire", ".service .wire"):
        assert re.search(rf"\.callboard {line} {{[^}}]*stroke: #[0-9a-f]{{6}}", plain), line


def test_lines_to_what_does_not_match_are_marked(graph: Callable[[str], GraphSnapshot]) -> None:
    """The style makes them red; others are as usual."""
    wires = re.findall('class="(wire[^"]*)"', svg_of(model_of(graph("mismatches"))))
    assert sorted(wires) == ["wire", *["wire mismatch"] * 4]
