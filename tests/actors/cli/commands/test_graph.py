"""`callboard graph`."""

from __future__ import annotations

import io
import json
import sys
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest

from actors.cli.main import main
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.qos.profile import QoSProfile, ReliabilityPolicy

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from tests.actors.cli.conftest import Desk


@pytest.fixture
async def talk(desk: Desk) -> AsyncIterator[Desk]:
    """Two nodes with a topic and a service between them."""
    async with desk.node("talker", namespace="r1") as talker, desk.node("listener") as listener:
        publisher = talker.create_publisher(String, "/chatter", 10)
        talker.create_client(AddTwoInts, "/add")
        listener.create_subscription(String, "/chatter", print, 10)
        listener.create_service(AddTwoInts, "/add", lambda request, response: response)
        await desk.matched(publisher)
        await listener.get_graph()
        yield desk


async def test_a_drawing(talk: Desk) -> None:
    """Plain, and as wide as it has to be, when it is piped."""
    code, out, err = await talk.callboard("graph")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        "╭────────────╮                ╭───────────╮",
        "│ /r1/talker ├╌╌▶ [/add] ╌╌╌╌▶│ /listener │",
        "│            ├──▶ /chatter ──▶│           │",
        "╰────────────╯                ╰───────────╯",
    ]


@pytest.mark.parametrize(
    ("options", "present", "absent"),
    [
        (["--ascii"], "+--> /chatter", "─"),
        (["--no-services"], "/chatter", "/add"),
        (["--nodes-only"], "/chatter", "▶ /chatter"),
        (["--width", "20"], "  publishes /chatter", "─"),
        (["--namespace", "r1"], "/r1/talker", "/listener"),
        (["--namespace", "/r1/"], "/r1/talker", "/listener"),
        (["--namespace", "/"], "/listener", "nothing"),
        (["--namespace", "r1", "--hide-dead-sinks"], "/r1/talker", "/chatter"),
        (["--namespace", "r1", "--hide-leaf-topics"], "/r1/talker", "/chatter"),
        (["--format", "dot"], "digraph callboard {", "─"),
        (["--format", "mermaid"], "flowchart LR", "─"),
        (["--format", "svg"], "<svg xmlns=", "─"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
async def test_options(talk: Desk, options: list[str], present: str, absent: str) -> None:
    """Each changes what is drawn, or how."""
    code, out, err = await talk.callboard("graph", *options)
    assert (code, err) == (0, "")
    assert present in out
    assert absent not in out


@pytest.mark.parametrize(
    "option", [["--json"], ["--format", "json"], ["--json", "--format", "json"]], ids=" ".join
)
async def test_json(talk: Desk, option: list[str]) -> None:
    """One document."""
    document = (await talk.callboard("graph", *option)).json
    assert document["nodes"] == [{"name": "/listener"}, {"name": "/r1/talker"}]
    assert document["topics"] == [{"name": "/chatter", "types": ["std_msgs/msg/String"]}]
    assert {"source": "/add", "target": "/listener", "relation": "serves"} in document["edges"]


async def test_nodes_that_strict_qos_keeps_apart_are_reported(desk: Desk) -> None:
    """On stderr, with the policy; the drawing of nodes only has no arrow between them."""
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    async with desk.node("talker") as talker, desk.node("listener", strict_qos=True) as listener:
        talker.create_publisher(String, "/chatter", best_effort)
        listener.create_subscription(String, "/chatter", print, 10)
        await talker.get_graph()
        await listener.get_graph()
        _, out, err = await desk.callboard("graph", "--nodes-only")
        assert "/chatter" not in out
        assert err == (
            "Not connected, as one of them is strict: /talker publishes /chatter with a QoS that /listener"
            " does not match: RELIABILITY\n"
        )


async def test_hidden_nodes_are_drawn_when_asked_for(desk: Desk) -> None:
    """Not otherwise."""
    async with desk.node("_shy") as node:
        await node.get_graph()
        assert (await desk.callboard("graph", "--include-hidden", "--json")).json["nodes"] == [
            {"name": "/_shy"}
        ]
        left_out = await desk.callboard("graph", "--json")
        assert left_out.json["nodes"] == []
        assert left_out.err.startswith("Left out: hidden nodes and such for debugging (1)")


@pytest.mark.parametrize(
    ("name", "begin"),
    [
        ("g.svg", "<svg"),
        ("g.SVG", "<svg"),
        ("g.dot", "digraph"),
        ("g.gv", "digraph"),
        ("g.mmd", "flowchart"),
        ("g.json", "{"),
        ("g.txt", "╭"),
    ],
)
async def test_the_file_says_which_format(talk: Desk, tmp_path: Path, name: str, begin: str) -> None:
    """By its suffix; nothing goes to stdout then."""
    file = tmp_path / name
    assert await talk.callboard("graph", "--output", str(file)) == (0, "", "")
    text = file.read_text(encoding="utf-8")
    assert text.startswith(begin)
    assert text.endswith("\n")
    if begin == "<svg":
        ET.fromstring(text)
    if begin == "{":
        json.loads(text)


async def test_the_option_is_stronger_than_the_file_name(talk: Desk, tmp_path: Path) -> None:
    """It is given explicitly."""
    file = tmp_path / "g.svg"
    assert (await talk.callboard("graph", "--format", "dot", "-o", str(file))).code == 0
    assert file.read_text(encoding="utf-8").startswith("digraph")


def test_a_file_whose_name_says_no_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is drawn: text in a .png would help nobody. That is said before a broker is looked for."""
    file = tmp_path / "g.png"
    assert main(["graph", "-o", str(file), "--url", "callboard://127.0.0.1:1"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("callboard graph: no format is known for '.png': call the file .svg, .dot,")
    assert not file.exists()


async def test_a_file_that_cannot_be_written(talk: Desk, tmp_path: Path) -> None:
    """One line, and 1."""
    code, out, err = await talk.callboard("graph", "-o", str(tmp_path / "no" / "g.svg"))
    assert (code, out) == (1, "")
    assert err == f"callboard graph: No such file or directory: {tmp_path}/no/g.svg\n"


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        (["--json", "--format", "svg"], 2, "callboard graph: --json contradicts --format svg\n"),
        (["--namespace", "/r2"], 1, "No nodes in namespace '/r2'; did you mean '/r1'?\n"),
    ],
    ids=["formats", "namespace"],
)
async def test_what_cannot_be_drawn(talk: Desk, options: list[str], code: int, text: str) -> None:
    """One line says why."""
    assert await talk.callboard("graph", *options) == (code, "", text)


async def test_an_invalid_namespace(talk: Desk) -> None:
    """Wrong usage, in ROS 2's words."""
    code, _, err = await talk.callboard("graph", "--namespace", "a-b")
    assert code == 2
    assert "must not contain characters other than alphanumerics" in err


async def test_an_empty_graph(desk: Desk) -> None:
    """It is no failure, but it is reported, not on stdout."""
    note = "There is nothing to draw: no nodes are running.\n"
    assert await desk.callboard("graph") == (0, "", note)
    assert (await desk.callboard("graph", "--json")).json["nodes"] == []


class Screen(io.TextIOWrapper):
    """A terminal."""

    def isatty(self) -> bool:
        """Say so."""
        return True


@pytest.mark.parametrize(
    ("encoding", "columns", "expected"),
    [("utf-8", 100, "╭"), ("ascii", 100, "+-"), ("utf-8", 20, "/listener")],
    ids=["boxes", "ascii", "narrow"],
)
async def test_a_terminal_gets_what_it_can_show(
    talk: Desk, monkeypatch: pytest.MonkeyPatch, encoding: str, columns: int, expected: str
) -> None:
    """Boxes if its encoding has them, a listing if it is narrow, and colours."""
    screen: Any = Screen(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", screen)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    assert (await talk.callboard("graph")).code == 0
    screen.flush()
    text = screen.buffer.getvalue().decode(encoding)
    assert text.startswith(expected)
    assert ("\x1b[1m" in text) is (columns == 100)
