"""`callboard mesh info` and `mesh list`: what they print of a report, without a mesh."""

from __future__ import annotations

import json
from contextlib import nullcontext
from typing import Any

import pytest

from actors.cli import broker_target
from actors.cli.commands.mesh import info
from actors.cli.commands.mesh import list as listing
from actors.cli.errors import CommandError
from actors.cli.parsing import Options
from actors.graph.broker_report import BrokerReport
from actors.graph.snapshot import GraphSnapshot
from proto.wire.mesh_keys import broker_id, zenoh_id
from proto.wire.stats import BrokerStats, MeshBrokerStats, MeshStats


class Report:
    """An inspector whose broker has joined two others, one of them by way of the other."""

    url = "callboard://127.0.0.1:1"

    def __init__(self, *, joined: bool = True) -> None:
        brokers = (
            MeshBrokerStats(1, "robot1", "1.0", direct=True),
            MeshBrokerStats(2, "robot2", "1.0", direct=True, round_trip_us=1500, sent=3, bytes_sent=30),
            MeshBrokerStats(3, "", "", round_trip_us=2500),
        )
        mesh = MeshStats(dropped=2, neighbours=f"{zenoh_id(2)} abcdef", sent=7, bytes_sent=70)
        self._report = BrokerReport(
            totals=BrokerStats(),
            topics={},
            links={},
            brokers={each.number: each for each in brokers} if joined else {},
            mesh=mesh,
        )

    def graph(self) -> GraphSnapshot:
        return GraphSnapshot()

    def report(self) -> BrokerReport:
        return self._report


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run a command against the report; return what it prints."""

    def run(command: Any, *, joined: bool = True, **options: Any) -> str:
        inspector = nullcontext(Report(joined=joined))
        monkeypatch.setattr(broker_target, "open_inspector", lambda options: inspector)
        assert command.run(Options(**{"json": False, "broker": None, **options})) == 0
        return capsys.readouterr().out

    return run


def test_the_broker_that_answers_shows_everything(run: Any) -> None:
    """Its traffic with all others, what went wrong, what waits, and whom Zenoh knows."""
    printed = run(info)
    assert printed.startswith("robot1\n")
    for line in (
        "Route: this broker",
        "Sent: 7 messages, 70 bytes\n",
        "2 dropped before they were sent",
        "nothing",
    ):
        assert line in printed
    assert f"robot2 ({broker_id(2)})" in printed
    assert "no broker (abcdef)" in printed


def test_another_broker_shows_the_traffic_with_it(run: Any) -> None:
    """By its name or its id; an unknown one is an error."""
    assert "Sent: 3 messages, 30 bytes, to this broker alone" in run(info, broker="robot2")
    assert "Round trip: 2.50 ms" in run(info, broker=broker_id(3))
    with pytest.raises(CommandError, match="robot9"):
        run(info, broker="robot9")
    with pytest.raises(CommandError, match="has not joined a mesh"):
        run(info, joined=False)


def test_json_has_the_same(run: Any) -> None:
    """Round trips in seconds; problems and neighbours of the broker that answers only."""
    own = json.loads(run(info, json=True))
    assert (own["route"], own["traffic"]["sent"], own["problems"]["dropped"]) == ("here", 7, 2)
    assert [each["name"] for each in own["neighbours"]] == ["robot2", None]
    other = json.loads(run(info, json=True, broker="robot2"))
    assert (other["route"], other["round_trip_sec"]) == ("direct", 0.0015)
    assert "problems" not in other
    assert [each["route"] for each in json.loads(run(listing, json=True))] == ["here", "direct", "indirect"]


def test_the_list_has_a_row_for_each_broker(run: Any) -> None:
    """Their routes and round trips."""
    printed = run(listing)
    for text in ("robot1", "1.50 ms", "indirect"):
        assert text in printed
