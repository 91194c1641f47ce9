"""`callboard top`: the graph at work, as a live view in a terminal, as tables, or as JSON."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from actors.cli.errors import FAILURE, OK, USAGE, CommandError
from actors.cli.output import print_json, print_out
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, positive
from proto.extras import install_command

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from actors.cli.commands.top.columns import Column, RowT
    from actors.tools.overview import Overview

EXAMPLES: Final = {
    "callboard top": "topics, nodes and services as they work, until q",
    "callboard top --once": "the same as plain tables, of one second",
    "callboard top --json --interval 10": "one document every ten seconds, until Ctrl-C",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--interval", type=positive, metavar="SEC", default=1.0, help="time between two samples; default: 1"
    )
    parser.add_flag("--once", help="print tables of two samples, and end")
    parser.add_argument(
        "--filter", metavar="TEXT", default="", help="only what has this in its name, type or state"
    )
    parser.add_flag("--include-hidden", help="also names with a leading _")
    add_json_option(
        parser,
        "one document per sample, or a single one with --once: interval_sec, totals, topics, nodes, services",
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Run the live view, print tables once, or print JSON until a signal."""
    if options.once or options.json:
        return _print(options)
    if not _has_terminal():
        raise CommandError("callboard top needs a terminal; without one: callboard top --once", USAGE)
    if find_spec("textual") is None:
        text = f"The live view needs textual: {install_command('top')}; without it: callboard top --once"
        raise CommandError(text, FAILURE)
    from actors.cli.commands.top import live

    return live.run(options)


def _has_terminal() -> bool:
    """Return whether there is a terminal with cursor control."""
    if os.environ.get("TERM") == "dumb" or sys.stdin is None:
        return False
    return sys.stdin.isatty() and sys.stdout.isatty()


def _print(options: Options) -> int:
    for seen in _overviews(options):
        if options.json:
            print_json(seen.as_dict())
        else:
            _print_tables(seen)
        if options.once:
            break
    return OK


def _overviews(options: Options) -> Generator[Overview]:
    """Take samples forever; the first one has no rates and is left out.

    Each sample uses a new connection: an idle one would be taken for silent.
    """
    from actors.cli.broker_target import open_inspector
    from actors.tools.overview import Sample, Samples

    samples = Samples(window=1)
    while True:
        with open_inspector(options) as inspector:
            seen = samples.add(Sample(inspector.graph(), inspector.report()))
        if seen.interval_sec:
            yield _wanted(seen, options)
        time.sleep(options.interval)


def _wanted(seen: Overview, options: Options) -> Overview:
    from actors.cli.commands.top.columns import found_in

    shown = seen if options.include_hidden else seen.without_hidden()
    topics, nodes, services = found_in(shown, options.filter)
    return replace(shown, topics=tuple(topics), nodes=tuple(nodes), services=tuple(services))


def _print_tables(seen: Overview) -> None:
    from actors.cli.commands.top.columns import NODES, SERVICES, TOPICS, headlines
    from actors.cli.tables import colored, painted

    color = colored(sys.stdout)
    for line in headlines(seen.totals):
        print("  ".join(painted(part.text, part.style, color=color) for part in line))
    _print_rows(TOPICS, seen.topics)
    _print_rows(NODES, seen.nodes)
    _print_rows(SERVICES, seen.services)


def _print_rows(columns: Sequence[Column[RowT]], rows: Sequence[RowT]) -> None:
    from actors.cli.tables import print_table

    if not rows:
        return
    columns = [column for column in columns if not column.optional or any(map(column.value, rows))]
    print_out("")
    print_table(
        [[column.cell(row) for column in columns] for row in rows],
        header=[column.title for column in columns],
        style=[column.style for column in columns],
    )
