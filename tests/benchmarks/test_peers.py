"""What the peers' roles have in common, and that peers can be asked for without being installed."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from benchmarks.harness.contender import Contender
from benchmarks.peers import PEERS, calls, stream, zenoh_roles
from benchmarks.peers.roles import Parameters

if TYPE_CHECKING:
    from collections.abc import Callable

PEERS_FOLDER = Path(__file__).parents[2] / "benchmarks" / "peers"


def parameters(**more: int) -> Parameters:
    """A subscriber's or publisher's parameters, for messages of 16 bytes."""
    return Parameters(role="subscriber", url="x://127.0.0.1:4222", seconds=1, size=16, **more)


@pytest.mark.parametrize("peer", PEERS)
def test_a_peer_is_a_contender_or_says_why_not(peer: str) -> None:
    """Asking never fails."""
    found = importlib.import_module(f"benchmarks.peers.{peer}").find()
    assert isinstance(found, Contender) or "is not installed" in found


@pytest.mark.parametrize("peer", PEERS)
def test_a_contender_says_what_its_client_is(peer: str) -> None:
    """The report shows the version, and only like compares with like."""
    found = importlib.import_module(f"benchmarks.peers.{peer}").find()
    if isinstance(found, str):
        pytest.skip(found)
    assert found.version.endswith((" (asyncio)", " (native, blocking)"))


def test_zenoh_shares_memory_in_one_contender_only() -> None:
    """The others' bytes pass through TCP, as everybody's do."""
    pytest.importorskip("zenoh")
    key = "transport/shared_memory/enabled"
    assert zenoh_roles.configuration("peer").get_json(key) == "false"
    assert zenoh_roles.configuration("peer", shared_memory=True).get_json(key) == "true"


@pytest.mark.parametrize("peer", PEERS)
def test_a_peer_whose_library_is_missing_says_so(peer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason names a package."""

    def missing(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", missing)
    assert "is not installed" in importlib.import_module(f"benchmarks.peers.{peer}").find()


def test_parameters_take_what_they_know() -> None:
    """Another workload's parameters are not an error, and the url gives host and port."""
    taken = Parameters.from_json(
        json.dumps({"role": "idle", "url": "tcp/127.0.0.1:7447", "seconds": 2, "rate_hz": 5})
    )
    assert (taken.role, taken.host, taken.port) == ("idle", "127.0.0.1", 7447)


def test_a_tally_answers_a_probe_and_the_end() -> None:
    """Nothing in between, if the system pushes back by itself."""
    tally = stream.Tally(parameters(subscriptions=2))
    readers = stream.Readers(parameters(subscriptions=2))
    said = [tally.take(stream.PROBE), *(tally.take(bytes(16)) for _ in range(6))]
    assert said[0] is not None
    assert said[1:] == [None] * 6
    readers.take(said[0])
    assert (readers.matched, readers.slowest) == (True, 0)
    assert tally.take(stream.end_mark(3)) is not None
    assert not tally.finished
    last = tally.take(stream.end_mark(3))
    assert last is not None
    readers.take(last)
    assert tally.finished
    assert readers.slowest == 3


def test_a_windowed_tally_acknowledges_often_enough() -> None:
    """What is not acknowledged is always less than half a window."""
    tally, readers = stream.Tally(parameters(), windowed=True), stream.Readers(parameters())
    window = stream.window_messages(16)
    probe = tally.take(stream.PROBE)
    assert probe is not None
    readers.take(probe)
    for count in range(1, 3 * window):
        acknowledgement = tally.take(bytes(16))
        if acknowledgement is not None:
            readers.take(acknowledgement)
        assert count - readers.slowest < window / 2


@pytest.mark.parametrize("size", [16, 256, 65536, 1 << 20, 1 << 24])
def test_windows_hold_a_burst_at_every_size(size: int) -> None:
    """Even a message larger than the window may be sent."""
    assert stream.window_messages(size) >= stream.burst_messages(size) >= 1


def test_calls_are_added_and_checked() -> None:
    """A wrong sum is an error."""
    number, data = calls.split_number(calls.numbered_reply(calls.numbered_request(7)))
    calls.check(number, data)
    with pytest.raises(ValueError, match="is not"):
        calls.check(8, data)


class Reports:
    """A parent that keeps what is reported to it."""

    def __init__(self) -> None:
        self.figures: dict[str, float] = {}

    def mark(self) -> None:
        """Ignore where the load begins."""

    def done(self, **figures: float) -> None:
        """Keep the figures."""
        self.figures = figures


def test_turns_keep_their_calls_in_flight() -> None:
    """Never more and, until the end, never fewer."""
    reports = Reports()
    flight: list[int] = []
    load = Parameters(role="requester", url="", seconds=0.01, in_flight=5)
    turns = calls.Turns(reports, load, flight.append)  # type: ignore[arg-type]
    turns.begin()
    while not turns.finished:
        assert 1 <= len(flight) <= 5
        number = flight.pop(0)
        turns.take(number, calls.reply(calls.request(number)))
    turns.report()
    assert reports.figures["calls"] > 0
    assert reports.figures["p50_us"] <= reports.figures["p99_us"]


def start_role(role: str, body: Callable[[Path], str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a role of a peer made up here, with nothing on its stdin."""
    program = folder / "made_up.py"
    program.write_text(body(PEERS_FOLDER.parents[1]))
    argument = json.dumps({"role": role, "url": "", "seconds": 1})
    return subprocess.run(
        [sys.executable, str(program), argument],
        input="",
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def made_up(root: Path) -> str:
    """A peer whose roles only wait."""
    return f"""
import sys
sys.path.insert(0, {str(root)!r})
from benchmarks.peers import roles
def wait(parent, parameters):
    parent.ready()
    parent.go.result()
def serve(parent, parameters):
    parent.ready()
    parent.closed.result()
    parent.done(messages=0, served=0)
roles.run({{"publisher": wait, "server": serve}}, sys.argv[1])
"""


@pytest.mark.processes
def test_a_server_ends_with_its_stdin(tmp_path: Path) -> None:
    """It reports, and ends well."""
    ended = start_role("server", made_up, tmp_path)
    assert ended.returncode == 0
    assert [json.loads(line)["event"] for line in ended.stdout.splitlines()] == ["ready", "done"]


@pytest.mark.processes
def test_any_other_role_gives_up_with_its_stdin(tmp_path: Path) -> None:
    """Nobody is left to report to."""
    ended = start_role("publisher", made_up, tmp_path)
    assert ended.returncode == 1
    assert "the parent has gone" in ended.stderr
