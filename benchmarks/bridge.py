"""callboard's bridge to ROS 2, next to a relay that a program for rclpy makes of 15 lines.

    python benchmarks/bridge.py                        all rows, about ten minutes
    python benchmarks/bridge.py "256 B" --rounds 3     the rows whose names contain one of these words

The ways of a row are loaded in turn, in each round; RELIABLE and KEEP_LAST 10 everywhere, at PACE of the rate
at which the relay loses nothing. One core has the relay, and the bridge with the broker; the others have the
sources and sinks. `cpu_us` is the CPU time of the relay, or of bridge and broker, for a message.
"""
# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT)  # `python benchmarks/bridge.py` puts this folder there

from actors.cli.bench import machine
from benchmarks.harness import meters
from benchmarks.threads import broker_process

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

REAL_PYTHON: Final = ROOT / "build" / "ros2" / "bin" / "python"
ROS_PROGRAM: Final = (str(REAL_PYTHON), str(ROOT / "benchmarks" / "bridge_program.py"))
CALLBOARD_PROGRAM: Final = (sys.executable, str(ROOT / "benchmarks" / "bridge_node.py"))
SIZES: Final = {"256 B": 256, "64 KiB": 65_536, "1 MiB": 1_048_576}
PACE: Final = 0.9
"""Part of the relay's loss-free rate at which all ways are loaded."""
SEARCH_STEPS: Final = 6
TRIES: Final = 3
"""Loads at a rate until one loses nothing."""
FASTEST: Final = {256: 20_000, 65_536: 8_000, 1_048_576: 800}
"""Messages a second, by size, at which the search for the loss-free rate begins."""
QUIET_SEC: Final = 0.4
"""A load has arrived when nothing has come for so long."""
READY_SEC: Final = 60.0
HZ: Final = 100
IDLE_SEC: Final = 10.0


class Way(NamedTuple):
    """A way of messages.

    Attributes:
        name: What it is called in the table.
        source: The process that publishes.
        sent: The topic that it publishes.
        sink: The process that receives.
        received: The topic that it receives.
        via: The processes between them.
    """

    name: str
    source: str
    sent: str
    sink: str
    received: str
    via: tuple[str, ...]


RELAY: Final = Way("relay", "ros source", "to_relay", "ros sink", "relayed", ("relay",))
HERE: Final = Way(
    "to callboard", "ros source", "to_callboard", "callboard sink", "to_callboard", ("bridge", "broker")
)
THERE: Final = Way(
    "to ROS", "callboard source", "from_callboard", "ros sink", "from_callboard", ("bridge", "broker")
)
CALLS: Final = {
    "within ROS": ("ros source", "ros_answer"),
    "to callboard": ("ros source", "callboard_answer"),
    "to ROS": ("callboard source", "ros_answer"),
}
NODES: Final = {
    "to callboard": ("ros source", "callboard sink"),
    "to ROS": ("callboard source", "ros sink"),
}
"""Whose nodes are seen where."""


class Role:
    """A process that answers commands."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.pid = process.pid
        self._process = process

    def ask(self, command: str, *arguments: object) -> Any:
        """Return the answer to a command."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps([command, *arguments]) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"{self._process.args!r} has ended")
        return json.loads(line)


class Stage:
    """The processes.

    Args:
        stack: Ends them.
        domain: The domain of ROS 2.
        with_bridge: Whether there is more than the relay.
    """

    def __init__(self, stack: ExitStack, domain: int, *, with_bridge: bool) -> None:
        self._stack = stack
        cores = sorted(os.sched_getaffinity(0))
        self._inner, self._outer = {cores[-1]}, set(cores[:-1] or cores)
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        self._environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "CALLBOARD_DOMAIN": "0",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_LOG_DIR": folder,
            "PYTHONPATH": str(ROOT),
        }
        self.roles: dict[str, Role] = {}
        self.pids: dict[str, int] = {}
        self._start("relay", self._inner, *ROS_PROGRAM, "relay")
        self._start("ros source", self._outer, *ROS_PROGRAM, "source")
        self._start("ros sink", self._outer, *ROS_PROGRAM, "sink")
        if with_bridge:
            with _pinned(self._inner):
                url, self.pids["broker"] = stack.enter_context(broker_process())
            self._environment["CALLBOARD_URL"] = url
            self._start("bridge", self._inner, str(REAL_PYTHON), "-m", "actors", "bridge", "ros2")
            self._start("callboard source", self._outer, *CALLBOARD_PROGRAM, "source")
            self._start("callboard sink", self._outer, *CALLBOARD_PROGRAM, "sink")

    def _start(self, name: str, cores: set[int], *command: str) -> None:
        with _pinned(cores):
            process = self._stack.enter_context(
                subprocess.Popen(
                    command,
                    env=self._environment,
                    cwd=ROOT,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE if name != "bridge" else subprocess.DEVNULL,
                    text=True,
                )
            )
        self._stack.callback(process.terminate)
        self.roles[name] = Role(process)
        self.pids[name] = process.pid

    def crowd(self) -> int:
        """Start nodes that do nothing; return how many endpoints they have."""
        self._start("crowd", self._outer, *ROS_PROGRAM, "crowd")
        count: int = self.roles["crowd"].ask("endpoints")
        return count

    def shown_endpoints(self) -> int:
        """Return how many endpoints of ROS 2 the bridge shows; 0 while it does not answer."""
        command = (sys.executable, "-m", "actors", "bridge", "info", "--json")
        done = subprocess.run(command, env=self._environment, capture_output=True, text=True, check=False)
        documents: list[Any] = json.loads(done.stdout) if done.returncode == 0 else []
        return sum(each["shown"]["callboard"]["endpoints"] for each in documents)

    def cpu_s(self, names: Sequence[str]) -> float:
        """Return the CPU time that processes have used."""
        return sum(meters.cpu_s(self.pids[name]) or 0.0 for name in names)

    def memory_kib(self, names: Sequence[str]) -> float:
        """Return the memory that processes have."""
        return sum(meters.memory_kib(self.pids[name]) or 0.0 for name in names)

    def load(self, way: Way, size: int, rate: float, seconds: float) -> dict[str, float]:
        """Load a way once; return its figures."""
        sink = self.roles[way.sink]
        sink.ask("forget", way.received)
        before = self.cpu_s(way.via)
        sent = self.roles[way.source].ask("load", way.sent, size, rate, seconds)
        self._settle(sink, way.received)
        used = self.cpu_s(way.via) - before
        figures: dict[str, float] = sink.ask("figures", way.received)
        received = figures["received"]
        return {
            "rate": figures["rate"],
            "sent_rate": sent["sent"] / sent["seconds"],
            "loss": 1 - received / sent["sent"],
            "cpu_us": 1e6 * used / max(received, 1),
            "p50_us": figures["p50_us"],
        }

    @staticmethod
    def _settle(sink: Role, topic: str) -> None:
        count = -1
        while (now := sink.ask("count", topic)) != count:
            count = now
            time.sleep(QUIET_SEC)

    def wait_until_connected(self, way: Way) -> None:
        """Load a way a little until something arrives."""
        end = time.monotonic() + READY_SEC
        while not self.load(way, 256, HZ, 0.2)["rate"]:
            if time.monotonic() > end:
                raise SystemExit(f"{way.name}: nothing arrives")

    def loss_free_rate(self, size: int, seconds: float) -> float:
        """Return the highest rate, to a few percent, at which the relay loses nothing."""
        low, high = 0.0, float(FASTEST[size])
        for _ in range(SEARCH_STEPS):
            middle = (low + high) / 2
            for _ in range(TRIES):  # a pause of the machine loses some, too
                figures = self.load(RELAY, size, middle, seconds)
                if figures["loss"] <= 0:
                    # A source that cannot send so fast says nothing about the relay beyond its own rate.
                    low = min(middle, figures["sent_rate"])
                    break
            else:
                high = middle
        return low


@contextmanager
def _pinned(cores: set[int]) -> Generator[None]:
    """Let processes that start here, and their threads, have some cores only."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


class Bench:
    """Measures rows and prints them.

    Args:
        words: Parts of names: a row is measured if its name contains one of them; none for all.
        rounds: How often each way is loaded.
        seconds: The length of a load.
        ways: What is loaded beside the relay.
        domain: The domain of ROS 2.
        alone: Whether to leave out the rows with nodes beside.
    """

    def __init__(
        self,
        words: Sequence[str],
        rounds: int,
        seconds: float,
        ways: Sequence[Way],
        domain: int,
        *,
        alone: bool,
    ) -> None:
        self._words = words
        self._rounds = rounds
        self._seconds = seconds
        self._ways = (RELAY, *ways)
        self._domain = domain
        self._alone = alone
        self.rows: dict[str, dict[str, dict[str, list[float]]]] = {}

    def run(self) -> None:
        """Measure everything."""
        with_bridge = len(self._ways) > 1
        if with_bridge and not self._alone and self._wants("idle and memory"):
            with ExitStack() as stack:  # before a load has made buffers
                self._idle(Stage(stack, self._domain, with_bridge=True))
        with ExitStack() as stack:
            stage = Stage(stack, self._domain, with_bridge=with_bridge)
            for way in self._ways:
                stage.wait_until_connected(way)
            self._rows(stage, "")
            if not self._alone:
                stage.crowd()
                self._rows(stage, ", 50 nodes beside")

    def _wants(self, name: str) -> bool:
        return not self._words or any(word in name for word in self._words)

    def _rows(self, stage: Stage, beside: str) -> None:
        for name, size in SIZES.items():
            if self._wants(name + beside):
                rate = PACE * stage.loss_free_rate(size, self._seconds)
                self._loads(stage, name + beside, size, rate, ("rate", "loss", "cpu_us"))
        if self._wants(f"{HZ} Hz{beside}"):
            self._loads(stage, f"{HZ} Hz{beside}", 256, HZ, ("p50_us",))
        if len(self._ways) > 1 and self._wants(f"one call{beside}"):
            found: dict[str, dict[str, list[float]]] = {name: {"p50_us": []} for name in CALLS}
            for _ in range(self._rounds):
                for name, (role, service) in CALLS.items():
                    figures = stage.roles[role].ask("calls", service, self._seconds)
                    found[name]["p50_us"].append(figures["p50_us"])
            self._print(f"one call{beside}", found)
        if len(self._ways) > 1 and self._wants(f"birth and end{beside}"):
            self._births(stage, f"birth and end{beside}")

    def _births(self, stage: Stage, row: str) -> None:
        """Measure after which time one side sees that a node of the other begins, and ends."""
        found: dict[str, dict[str, list[float]]] = {name: {"birth_s": [], "end_s": []} for name in NODES}
        for number in range(self._rounds):
            for name, (here, there) in NODES.items():
                node = f"born_{number}_of_{here.partition(' ')[0]}"
                for key, command, arguments in (("birth_s", "begin", (node,)), ("end_s", "end", ())):
                    began = stage.roles[here].ask(command, *arguments)
                    seen = stage.roles[there].ask("see", node, key == "birth_s")
                    found[name][key].append(seen - began)
        self._print(row, found)

    def _loads(self, stage: Stage, name: str, size: int, rate: float, keys: Sequence[str]) -> None:
        found: dict[str, dict[str, list[float]]] = {way.name: {key: [] for key in keys} for way in self._ways}
        for _ in range(self._rounds):
            for way in self._ways:
                figures = stage.load(way, size, rate, self._seconds)
                for key in keys:
                    found[way.name][key].append(figures[key])
        self._print(f"{name}, {rate:,.0f}/s", found)

    def _idle(self, stage: Stage) -> None:
        """Measure what nodes that do nothing cost, once the bridge shows them."""
        own = ("bridge", "broker")
        _wait_until_idle(stage, own)
        before, shown = stage.memory_kib(own), stage.shown_endpoints()
        endpoints = stage.crowd()
        while stage.shown_endpoints() < shown + endpoints:
            time.sleep(QUIET_SEC)
        _wait_until_idle(stage, own)
        memory, shown = stage.memory_kib(own) - before, stage.shown_endpoints() - shown
        began, used = time.monotonic(), stage.cpu_s(own)
        time.sleep(IDLE_SEC)
        part = (stage.cpu_s(own) - used) / (time.monotonic() - began)
        figures = {"cpu": [part], "kib_per_endpoint": [memory / shown], "endpoints": [float(shown)]}
        self._print("idle and memory, 50 nodes beside", {"bridge and broker": figures})

    def _print(self, name: str, found: dict[str, dict[str, list[float]]]) -> None:
        self.rows[name] = found
        print(name, *(f"{way}: {_cell(figures)}" for way, figures in found.items()), sep="  |  ", flush=True)


def _wait_until_idle(stage: Stage, names: Sequence[str]) -> None:
    """Wait until processes use less than a tenth of a CPU for a second."""
    used = -1.0
    while (now := stage.cpu_s(names)) - used > 0.1:
        used = now
        time.sleep(1)


def _cell(figures: dict[str, list[float]]) -> str:
    return ", ".join(f"{key} {_spread(values)}" for key, values in figures.items())


def _spread(values: Sequence[float]) -> str:
    text = f"{statistics.median(values):,.4g}"
    return text if len(values) == 1 else f"{text} ({min(values):,.4g} to {max(values):,.4g})"


def main() -> None:
    """Measure rows and print them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("words", nargs="*", help="parts of names of rows; default: all rows")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=2.0, help="length of each load; default: 2")
    parser.add_argument("--domain-id", type=int, default=96, help="the domain of ROS 2; default: 96")
    parser.add_argument("--alone", action="store_true", help="without the rows with nodes beside")
    parser.add_argument("--relay-only", action="store_true", help="measure ROS 2's relay alone")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    options = parser.parse_args()
    if not REAL_PYTHON.exists():
        raise SystemExit(f"{REAL_PYTHON} does not exist: run `make test`, which builds it")
    ways = () if options.relay_only else (HERE, THERE)
    bench = Bench(
        options.words, options.rounds, options.seconds, ways, options.domain_id, alone=options.alone
    )
    bench.run()
    if not bench.rows:
        raise SystemExit(f"no row has a name with {' or '.join(map(repr, options.words))}")
    if options.json:
        document = {"machine": machine.describe(), "rounds": options.rounds, "rows": bench.rows}
        options.json.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
