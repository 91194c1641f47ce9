"""Results as Markdown: the generated part of docs/performance.md, and that of the page about targets.

Everything is a median over the repetitions, with the least and the most where there are several.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.bench.results import number
from benchmarks.harness.outcomes import CPU
from benchmarks.harness.results import advantage
from benchmarks.harness.tables import shown
from benchmarks.harness.workloads import WORKLOADS
from benchmarks.targets import verdicts

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from benchmarks.harness.results import Entrant, Results
    from benchmarks.harness.workloads import Case, Figure, Workload

BEGIN = "<!-- results: made by benchmarks/suite.py -->"
END = "<!-- end of results -->"


def updated(page: str, text: str) -> str:
    """Return the page with a new text between its markers.

    Raises:
        ValueError: A marker is missing.
    """
    return spliced(page, BEGIN, END, text)


def spliced(page: str, begin: str, end: str, text: str) -> str:
    """Return the page with the text between two markers replaced.

    Raises:
        ValueError: A marker is missing.
    """
    head, found_begin, rest = page.partition(begin)
    _, found_end, tail = rest.partition(end)
    if not found_begin or not found_end:
        raise ValueError(f"the page needs the markers {begin!r} and {end!r}")
    return f"{head}{begin}\n\n{text}\n\n{end}{tail}"


def body(results: Results) -> str:
    """Return all tables for users: callboard's figures in short, next to its peers, then each workload."""
    parts = [
        "### In short",
        _in_short(results),
        "![callboard and its peers](performance.svg)",
        _about(results),
    ]
    parts += ["### Against each peer", _ratios(results)]
    for workload in WORKLOADS:
        section = _workload(results, workload)
        if section:
            parts += [f"### {workload.id}: {workload.title}", *section]
    return "\n\n".join(part for part in parts if part)


def targets(results: Results) -> str:
    """Return the table of targets, for developers."""
    rows = [
        [verdict.what, verdict.target, verdict.found, "yes" if verdict.reached else "**no**"]
        for verdict in verdicts(results)
    ]
    note = f"Measured on {results.date[:10]}, with the results in [performance](../performance.md#results)."
    return note + "\n\n" + table(["", "target", "found", "reached"], rows)


def _in_short(results: Results) -> str:
    """Return a table of callboard's medians: the main figure of each case that is no point of a curve."""
    rows: list[list[str]] = []
    for workload in WORKLOADS:
        figure = headline(workload)
        for case in workload.cases:
            found = results.figures(workload.id, case.name, "callboard").get(figure.key)
            if found is not None and case.curve is None:
                rows.append([workload.title, case.name, f"{number(found.median)} {figure.title}"])
    return table(["", "", "callboard"], rows)


def _about(results: Results) -> str:
    machine = ", ".join(f"{name} {value}" for name, value in results.machine.items())
    how = (
        f"Measured on {results.date[:10]} with `{results.command}`: {results.repetitions} repetitions of"
        f" {results.seconds:g} s each (W5 and W8: one), {machine}."
    )
    versions = "; ".join(f"{each.name} {each.version}" for each in results.entrants)
    lines = [how, f"Versions: {versions}."]
    lines += [f"Skipped: {name}: {reason}." for name, reason in results.skipped.items()]
    lines += [
        f"Failed: {each.workload} {each.case}, {each.contender}: {each.reason.splitlines()[0]}."
        for each in results.failures
    ]
    return "\n\n".join(lines)


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; all columns but the first are right-aligned."""
    aligned = ["---", *["---:"] * (len(heading) - 1)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (heading, aligned, *rows))


def rivals(results: Results) -> list[Entrant]:
    """Return the peers: everybody who is not a form of callboard."""
    return [each for each in results.entrants if not each.name.startswith("callboard")]


def _ratios(results: Results) -> str:
    """How many times better callboard is than each peer, by each workload's first figure."""
    peers = rivals(results)
    rows: list[list[str]] = []
    for workload in WORKLOADS:
        for case in workload.cases:
            cells = [_ratio(results, workload, case, peer) for peer in peers]
            if any(cell != "-" for cell in cells):
                rows.append([f"{workload.id} {case.name}", *cells])
    if not rows:
        return ""
    note = "How many times the rate, or how many times less delay or memory. Above 1, callboard is better."
    return note + "\n\n" + table(["", *(peer.name for peer in peers)], rows)


def _ratio(results: Results, workload: Workload, case: Case, peer: Entrant) -> str:
    figure = headline(workload)
    own = results.figures(workload.id, case.name, "callboard").get(figure.key)
    other = results.figures(workload.id, case.name, peer.name).get(figure.key)
    if own is None or other is None:
        return "-"
    ratio = advantage(own.median, other.median, more_is_better=figure.more_is_better)
    return f"**{ratio:.2f}**" if ratio >= 1 else f"{ratio:.2f}"


def headline(workload: Workload) -> Figure:
    """Return the figure by which contenders are compared."""
    return next(figure for figure in workload.figures if figure.key != "connections")


def _workload(results: Results, workload: Workload) -> list[str]:
    """Return a workload's tables: by contender if there are several, by case otherwise."""
    names = [
        entrant.name
        for entrant in results.entrants
        if any(results.figures(workload.id, case.name, entrant.name) for case in workload.cases)
    ]
    if not names:
        return []
    if any(not name.startswith("callboard") for name in names):
        return [_by_contender(results, workload, case) for case in workload.cases]
    return [_by_case(results, workload, name) for name in names]


def _by_contender(results: Results, workload: Workload, case: Case) -> str:
    """Return a case's table: the best contender first."""
    figure = headline(workload)
    found = {each.name: results.figures(workload.id, case.name, each.name) for each in results.entrants}
    found = {name: figures for name, figures in found.items() if figure.key in figures}
    if not found:
        return ""
    names = sorted(found, key=lambda name: found[name][figure.key].median, reverse=figure.more_is_better)
    roles = list(dict.fromkeys(key for name in found for key in found[name] if key.startswith(CPU)))
    columns = [each.key for each in workload.figures] + roles
    own = found.get("callboard")
    rows: list[list[str]] = []
    for name in names:
        cells = [shown(found[name].get(key)) for key in columns]
        ratio = "-"
        if own is not None:
            mine, other = own[figure.key].median, found[name][figure.key].median
            ratio = f"{advantage(mine, other, more_is_better=figure.more_is_better):.2f}"
        rows.append([f"**{name}**" if name == "callboard" else name, *cells, ratio])
    heading = [
        case.name,
        *(each.title for each in workload.figures),
        *_cpu_titles(roles),
        "callboard is x better",
    ]
    return table(heading, rows)


def _by_case(results: Results, workload: Workload, name: str) -> str:
    """Return a contender's table; points of curves say how they compare with the first of their curve."""
    figure = headline(workload)
    measured = [(case, results.figures(workload.id, case.name, name)) for case in workload.cases]
    measured = [(case, figures) for case, figures in measured if figures]
    roles = list(dict.fromkeys(key for _, figures in measured for key in figures if key.startswith(CPU)))
    columns = [each.key for each in workload.figures] + roles
    first: dict[str, float] = {}
    rows: list[list[str]] = []
    for case, figures in measured:
        cells = [case.name, *(shown(figures.get(key)) for key in columns)]
        if case.curve is not None:
            median = figures[figure.key].median
            cells.append(number(median / first.setdefault(case.curve[0], median)))
        rows.append(cells)
    heading = [name, *(each.title for each in workload.figures), *_cpu_titles(roles)]
    return table([*heading, "x the first"] if first else heading, rows)


def _cpu_titles(roles: Iterable[str]) -> list[str]:
    return [f"{role.removeprefix(CPU)} µs CPU" for role in roles]
