"""Two brokers that are joined, next to one, and to nats-server and Zenoh with the same second hop.

    python benchmarks/mesh.py                         about six minutes, writes docs/mesh.json
    python benchmarks/mesh.py W3 --repetitions 3    a part, only printed

Publishers and requesters connect to the near server, subscribers and services to a far one; all servers are
on this machine. "callboard (joined)" has both on the near broker, while it is joined with another one: what a
mesh costs local traffic. "zenoh (direct)" has no server: its round trip is the least that a mesh of Zenoh can
take. Trials are interleaved, and each ratio is the median of the repetitions' own ratios.
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import argparse
import json
import shlex
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.harness.contender import Contender

ROOT = Path(__file__).resolve().parent.parent
# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(ROOT)

import msgspec

import actors
from actors.cli.bench import machine
from benchmarks.harness import tables
from benchmarks.harness.own import callboard
from benchmarks.harness.progress import line
from benchmarks.harness.results import Entrant, Results
from benchmarks.harness.runner import plan, run
from benchmarks.harness.workloads import WORKLOADS, Case, Workload
from benchmarks.peers import nats_py, zenoh_direct, zenoh_router
from benchmarks.peers.roles import command as role_command

JSON = ROOT / "docs" / "mesh.json"
HOP = (sys.executable, str(ROOT / "benchmarks" / "second_hop.py"))
LINKS = 100
"""Servers listen for each other at so much above their port for clients."""
CLUSTER = """
cluster {{ name: bench, listen: "127.0.0.1:{port}", routes: [{routes}] }}
"""
CASES = {"W1": ("256 B", "64 KiB"), "W3": ("1 in flight",), "W4": ("100 in flight",)}
FAN_OUT = "fan-out"
BROKERS, COPIES = 4, 5
RATIOS = (
    ("callboard (mesh)", "callboard", "across / local"),
    ("callboard (joined)", "callboard", "joined / not joined, local traffic"),
    ("callboard (mesh)", "nats-py (mesh)", "across / nats-py across"),
    ("callboard (mesh)", "zenoh (router) (mesh)", "across / zenoh across"),
)

Servers = Callable[[Sequence[int], Path], list[list[str]]]
"""(ports, scratch directory) -> the command of each; the first is the near one."""


def brokers(ports: Sequence[int], _: Path) -> list[list[str]]:
    """Far brokers listen, the near one joins them all."""
    base = [sys.executable, "-m", "actors", "broker", "--log-level", "warning"]
    links = [f"tcp/127.0.0.1:{port + LINKS}" for port in ports]
    near = [*base, "--port", str(ports[0]), "--mesh", ",".join(links[1:])]
    far = zip(ports[1:], links[1:], strict=True)
    return [near, *([*base, "--port", str(port), "--mesh-listen", link] for port, link in far)]


def nats_servers(ports: Sequence[int], scratch: Path) -> list[list[str]]:
    """A cluster, each with routes to those that start before it."""
    commands: list[list[str]] = []
    for number, port in enumerate(ports):
        others = ports[1:] if number == 0 else ()
        routes = ", ".join(f'"nats://127.0.0.1:{each + LINKS}"' for each in others)
        file = scratch / f"nats{number}.conf"
        text = nats_py.CONFIGURATION.format(port=port, log=scratch / f"nats{number}.log")
        file.write_text(text + CLUSTER.format(port=port + LINKS, routes=routes))
        commands.append(["nats-server", "--config", str(file)])
    return commands


def zenoh_routers(ports: Sequence[int], _: Path) -> list[list[str]]:
    """Routers whose clients and other routers come to the same port."""
    urls = [f"tcp/127.0.0.1:{port}" for port in ports]
    serve = [*role_command("zenoh_router"), "serve"]
    return [[*serve, *urls], *([*serve, url] for url in urls[1:])]


def joined(contender: Contender, servers: Servers, *, far: int = 1, local: bool = False) -> Contender:
    """Return a contender with that many far servers; `local` leaves all roles at the near one."""

    def ports(port: int) -> list[int]:
        return [port + number for number in range(far + 1)]

    def command(port: int, scratch: Path) -> list[str]:
        pairs = list(zip(ports(port), servers(ports(port), scratch), strict=True))
        return [*HOP, "serve", json.dumps(pairs)]

    def url(port: int) -> str:
        return ",".join(contender.server_url(each) for each in ports(port)[: 1 if local else None])

    return replace(
        contender,
        name=f"{contender.name} ({'joined' if local else 'mesh'})",
        role_command=(*HOP, "role", *contender.role_command),
        server_command=command,
        server_url=url,
    )


def contenders(far: int) -> tuple[list[Contender], dict[str, str]]:
    """Return who is measured, and who is not, with the reason; `far` servers beside the near one."""
    found = [callboard(), joined(callboard(), brokers, far=far, local=True)]
    found.append(joined(callboard(), brokers, far=far))
    skipped: dict[str, str] = {}
    for name, peer, servers in (
        ("nats_py", nats_py.find(), nats_servers),
        ("zenoh_router", zenoh_router.find(), zenoh_routers),
    ):
        if isinstance(peer, str):
            skipped[name] = peer
        else:
            found += [peer, joined(peer, servers, far=far)]
    direct = zenoh_direct.find()
    if not isinstance(direct, str):
        found.append(direct)
    return found, skipped


def workloads(ids: Sequence[str]) -> list[Workload]:
    """Return the part of each workload that is measured here."""
    found = [
        replace(each, cases=tuple(case for case in each.cases if case.name in CASES[each.id]))
        for each in WORKLOADS
        if each.id in CASES
    ]
    title = f"one publisher, {BROKERS} far brokers with {COPIES} subscribers each, 256 B"
    crowd = next(each for each in WORKLOADS if each.id == "W2")
    found.append(replace(crowd, id=FAN_OUT, title=title, cases=(_fan_out(crowd.cases[0]),)))
    return [each for each in found if not ids or each.id in ids]


def _fan_out(case: Case) -> Case:
    """A subscriber process at each far broker."""
    *_, subscriber, publisher = case.parts
    parameters = {**subscriber.parameters, "subscriptions": COPIES}
    parts = [replace(subscriber, parameters={**parameters, "number": number}) for number in range(BROKERS)]
    last = replace(publisher, parameters={**publisher.parameters, "readers": BROKERS})
    return replace(case, name=f"{BROKERS} x {COPIES}", parts=(*parts, last))


async def measured(options: argparse.Namespace) -> Results:
    """Run the trials; print how far it is."""
    chosen = workloads(options.workloads)
    pairs, skipped = contenders(1)
    several, _ = contenders(BROKERS)
    trials = plan([each for each in chosen if each.id != FAN_OUT], pairs, options.repetitions)
    trials += plan([each for each in chosen if each.id == FAN_OUT], several, options.repetitions)
    results = Results(
        machine=machine.describe(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        command=shlex.join(["python", "benchmarks/mesh.py", *sys.argv[1:]]),
        seconds=options.seconds,
        repetitions=options.repetitions,
        entrants=[Entrant.of(contender) for contender in pairs],
        skipped=skipped,
    )
    began = time.monotonic()
    await run(trials, results, lambda progress: print(line(progress), file=sys.stderr, flush=True))
    print(f"{len(trials)} trials in {time.monotonic() - began:.0f} s, {len(results.failures)} failed")
    return results


def ratio(results: Results, workload: Workload, case: Case, one: str, other: str) -> str:
    """Return the median of the first figure's ratio within each repetition, with the least and the most."""
    key = workload.figures[0].key
    values: dict[tuple[str, int], float] = {
        (each.contender, each.repetition): each.figures[key]
        for each in results.samples
        if (each.workload, each.case) == (workload.id, case.name)
    }
    ratios = [
        values[one, number] / values[other, number]
        for number in range(results.repetitions)
        if (one, number) in values and (other, number) in values
    ]
    return f"{statistics.median(ratios):.3f} ({min(ratios):.3f} to {max(ratios):.3f})" if ratios else "-"


def report(results: Results, chosen: Sequence[Workload]) -> str:
    """Return figures and ratios as text."""
    lines: list[str] = []
    for workload in chosen:
        for case in workload.cases:
            lines += ["", f"{workload.id} {case.name}: {workload.title}"]
            titles = ["", *(figure.title for figure in workload.figures)]
            rows = [
                [entrant.name, *(tables.shown(found.get(figure.key)) for figure in workload.figures)]
                for entrant in results.entrants
                if (found := results.figures(workload.id, case.name, entrant.name))
            ]
            lines += tables.aligned([titles, *rows])
            title = workload.figures[0].title
            lines += [
                f"  {title}, {what}: {ratio(results, workload, case, one, other)}"
                for one, other, what in RATIOS
            ]
    lines += [f"skipped: {name}: {reason}" for name, reason in results.skipped.items()]
    lines += [
        f"failed: {each.workload} {each.case} {each.contender}: {each.reason}" for each in results.failures
    ]
    return "\n".join(lines)


def main() -> int:
    """Measure, print, write; the exit code says whether callboard has failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("workloads", nargs="*", metavar="WORKLOAD", help=f"of W1, W3, W4, {FAN_OUT}")
    parser.add_argument("--repetitions", type=int, default=4, help="of each case; default: 4")
    parser.add_argument("--seconds", type=float, default=1.0, help="length of each load; default: 1")
    parser.add_argument("--no-write", action="store_true", help="leave docs/mesh.json as it is")
    options = parser.parse_args()
    if unknown := {*options.workloads} - {*CASES, FAN_OUT}:
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    results = actors.run(lambda: measured(options), args=[])
    if results is None:  # a signal has ended it, and every process with it
        return 130
    print(report(results, workloads(options.workloads)))
    if not options.no_write and not options.workloads:
        JSON.write_text(
            msgspec.json.format(msgspec.json.encode(results.document()), indent=1).decode() + "\n"
        )
    return int(any(failure.contender.startswith("callboard") for failure in results.failures))


if __name__ == "__main__":
    sys.exit(main())
