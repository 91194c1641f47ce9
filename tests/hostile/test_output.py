"""No line of a command's output can be forged by names, even if a broker has accepted them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main
from actors.graph.broker_report import ReportParts
from actors.graph.inspector import Inspector
from actors.interfaces.convert import message_to_yaml
from actors.interfaces.yaml_reader import load_yaml
from proto import limits
from proto.wire import frames
from proto.wire.codec import encode
from proto.wire.codes import EntryKind
from proto.wire.stats import LinkStats, TopicStats
from tests.actors.graph.test_inspector import WELCOME, listener

if TYPE_CHECKING:
    from collections.abc import Iterable

FORGED = "\n/forged\r\x1b[2J\u202e"


def graph() -> frames.Graph:
    """Return a graph with a hostile text in each name."""
    node, topic, type_name = (f"/{name}{FORGED}" for name in ("node", "topic", "type"))
    entry = frames.GraphEntry(1, EntryKind.NODE, node, "", "", "", {})
    kinds: Iterable[EntryKind] = (
        EntryKind.PUBLISHER,
        EntryKind.SUBSCRIPTION,
        EntryKind.SERVICE,
        EntryKind.CLIENT,
    )
    endpoints = [
        entry._replace(key=key, kind=kind, name=topic, type_name=type_name, type_hash=f"RIHS01_{FORGED}")
        for key, kind in enumerate(kinds, 2)
    ]
    return frames.Graph(1, False, (entry, *endpoints), (), ())


@pytest.mark.parametrize(
    "command",
    [
        "topic list",
        "topic list -t",
        "topic list -v",
        "topic list --json",
        "service list",
        "node list",
        "node list --json",
        *(f"graph --format {kind}" for kind in ("text", "dot", "svg", "mermaid", "json")),
    ],
)
def test_names_in_the_graph_forge_no_line(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Case 60: control characters are shown as escapes; a name has one line."""
    with listener(WELCOME, encode(graph())) as url:
        assert main([*command.split(), "--url", url]) == 0
    out = capsys.readouterr().out
    assert "forged" in out
    assert not [line for line in out.splitlines() if line.lstrip(" │\"'*-").startswith(("/forged", "forged"))]
    assert out.replace("\n", "").isprintable()


def test_names_in_a_snapshot_are_printable() -> None:
    """Case 60: for programs, too, which print what they get."""
    with listener(WELCOME, encode(graph())) as url, Inspector(url) as inspector:
        snapshot = inspector.graph()
        inspector.close()
    (node,) = snapshot.nodes()
    assert node == "/node\\n/forged\\r\\x1b[2J\\u202e"
    for entry in snapshot.entries.values():
        assert f"{entry.node}{entry.name}{entry.type_name}{entry.type_hash}".isprintable()


def test_names_in_a_report_and_a_greeting_are_printable() -> None:
    """Case 60: topics, nodes and agents."""
    parts = ReportParts()
    topic = TopicStats(0, f"/t{FORGED}", *[0] * (len(TopicStats._fields) - 2))
    link = LinkStats(0, 1, f"agent{FORGED}" * 100, (f"/n{FORGED}",), 0, False, *[0] * 9)
    parts.add(frames.Stats(1, False, {}, (topic,), (link,)))
    report = parts.report()
    assert list(report.topics) == [report.topics["/t\\n/forged\\r\\x1b[2J\\u202e"].name]
    assert report.links[1].nodes == ("/n\\n/forged\\r\\x1b[2J\\u202e",)
    assert len(report.links[1].agent) <= limits.MAX_ERROR_TEXT
    assert report.links[1].agent.isprintable()
    welcome = encode(frames.Welcome(limits.PROTOCOL_VERSION, {"agent": f"broker{FORGED}"}))
    with listener(welcome) as url, Inspector(url) as inspector:
        assert str(inspector.welcome["agent"]).isprintable()
        inspector.close()


def test_keys_of_a_message_forge_no_line() -> None:
    """Case 60: of a message whose class is not known, as `topic echo` prints it."""
    message = {"a\n---\nb: 1": {f"c{FORGED}": 2}, "größe": 3}
    text = message_to_yaml(message)
    assert len(text.splitlines()) == 4
    assert text.startswith('? "a\\n---\\nb: 1"\n: ? "c\\n/forged')
    assert "größe: 3" in text
    assert load_yaml(text) == message
