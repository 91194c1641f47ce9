"""`callboard top` where it is not a live view."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from actors.cli import broker_target
from actors.cli.main import main
from actors.graph.snapshot import GraphSnapshot
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from proto.extras import install_command
from tests.actors.tools.made_up import sample

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator
    from typing import Self

    from actors.tools.overview import Sample
    from tests.actors.cli.conftest import Desk

SHORT = ("--interval", "0.05")


@asynccontextmanager
async def some_work(desk: Desk) -> AsyncGenerator[None]:
    """A node with topics and a service, and hidden ones."""
    async with desk.node("worker") as node:
        for topic in ("chatter", "zoo", "_secret"):
            node.create_publisher(String, topic, 10)
        node.create_subscription(String, "chatter", print)
        node.create_service(AddTwoInts, "add", lambda request, response: response)
        await node.get_graph()
        yield


async def test_once_prints_three_tables(desk: Desk) -> None:
    """Below what the broker does; nothing hidden."""
    async with some_work(desk):
        code, out, err = await desk.callboard("top", "--once", *SHORT)
    assert (code, err) == (0, "")
    condition, work, *tables = out.splitlines()
    assert re.fullmatch(r"up \S+ s|up .* {2}connections 2 {2}loop late by .*", condition)
    assert re.fullmatch(r"routed 0/s {2}delivered 0/s {2}drops 0/s {2}calls 0/s {2}queued 0", work)
    rows = [line.split() for line in tables]
    assert rows.pop(6)[:3] == ["/worker", "linked", "5"]  # the broker may ask it for a sign of life meanwhile
    assert rows == [
        [],
        ["TOPIC", "PUBS", "SUBS", "MSG/S", "B/S", "DROPS/S", "QUEUED", "LOST", "TYPE"],
        ["/chatter", *"1100000", "std_msgs/msg/String"],
        ["/zoo", *"1000000", "std_msgs/msg/String"],
        [],
        ["NODE", "STATE", "ENDS", "IN", "B/S", "OUT", "B/S", "DROPS/S", "QUEUED", "LOST", "CALLS", "OWED"],
        [],
        ["SERVICE", "SERVERS", "CLIENTS", "OWED", "TYPE"],
        ["/add", *"100", "example_interfaces/srv/AddTwoInts"],
    ]


async def test_once_as_json(desk: Desk) -> None:
    """One document; a filter and hidden names work here, too."""
    async with some_work(desk):
        seen = (await desk.callboard("top", "--once", "--json", *SHORT)).json
        assert set(seen) == {"interval_sec", "seconds", "totals", "topics", "nodes", "services"}
        assert seen["interval_sec"] == seen["seconds"] > 0
        assert [row["name"] for row in seen["topics"]] == ["/chatter", "/zoo"]
        assert seen["topics"][0]["types"] == ["std_msgs/msg/String"]
        wanted = ["top", "--once", "--json", *SHORT, "--include-hidden", "--filter", "SECRET"]
        seen = (await desk.callboard(*wanted)).json
        assert [row["name"] for row in seen["topics"]] == ["/_secret"]
        assert seen["nodes"] == seen["services"] == []


async def test_nobody_there(desk: Desk) -> None:
    """No tables, but what the broker does."""
    code, out, _ = await desk.callboard("top", "--once", *SHORT)
    assert (code, len(out.splitlines())) == (0, 2)


def test_json_goes_on_until_nobody_reads(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One document per line, for each sample after the first."""
    samples = [sample(float(second), GraphSnapshot(), routed=10 * second) for second in range(4)]
    monkeypatch.setattr(broker_target, "open_inspector", lambda options: FakeInspector(samples))
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    assert main(["top", "--json"]) == 141
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert all('"routed_per_sec": 10.0' in line for line in lines)


class FakeInspector:
    """Returns samples one by one, then the pipe breaks."""

    def __init__(self, samples: list[Sample]) -> None:
        self._samples = samples

    def __enter__(self) -> Self:
        if not self._samples:
            raise BrokenPipeError
        self._sample = self._samples.pop(0)
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def graph(self) -> object:
        """Return the graph of this sample."""
        return self._sample.snapshot

    def report(self) -> object:
        """Return the counters of this sample."""
        return self._sample.report


def test_no_broker_is_reported_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """With the command that starts one."""
    assert main(["top", "--once", "--url", "callboard://127.0.0.1:1"]) == 3
    assert "Start one with: callboard broker --port 1" in capsys.readouterr().err


def test_a_live_view_needs_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    """The text says what to do without one."""
    assert main(["top"]) == 2
    assert capsys.readouterr().err == "callboard top needs a terminal; without one: callboard top --once\n"


def test_a_terminal_that_shows_only_lines_is_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """TERM=dumb, and no stdin at all: the same text."""
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")
    assert main(["top"]) == 2
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["top"]) == 2
    assert capsys.readouterr().err.count("callboard top needs a terminal; without one:") == 2


def test_without_textual_the_text_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, exit code 1."""
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr("actors.cli.commands.top.find_spec", lambda name: None)
    assert main(["top"]) == 1
    assert install_command("top") in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--help"], ["top", "--help"], ["top"]], ids=" ".join)
@pytest.mark.processes
def test_only_the_live_view_loads_textual(arguments: list[str]) -> None:
    """Help starts fast, and so does the error without a terminal."""
    code = (
        f"import sys; from actors.cli.main import main; main({arguments});"
        "sys.exit(bool({'textual', 'rich', 'asyncio'} & set(sys.modules)))"
    )
    silent = subprocess.DEVNULL
    subprocess.run([sys.executable, "-c", code], check=True, stdout=silent, stderr=silent, timeout=50)
