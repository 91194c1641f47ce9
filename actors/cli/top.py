"""`callboard top`: what goes on, as a live view in a terminal, as tables, or as JSON."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from actors.cli.errors import FAILURE, OK, USAGE, CommandError
from actors.cli.output import say, say_json
from actors.cli.place import inspector
from actors.cli.tables import colored, painted, say_table
from actors.cli.top_columns import NODES, SERVICES, TOPICS, Column, RowT, found_in, headlines
from actors.tools.overview import Look, Looks

if TYPE_CHECKING:
    import argparse
    from collections.abc import Generator, Sequence

    from actors.tools.overview import Overview

MISSING: Final = "The live view needs textual: pip install 'callboard[top]'; without it: callboard top --once"


def run(options: argparse.Namespace) -> int:
    """Show what goes on: live, or printed once, or as JSON until a signal."""
    if options.once or options.json:
        return _print(options)
    if not _has_terminal():
        raise CommandError("callboard top needs a terminal; without one: callboard top --once", USAGE)
    if find_spec("textual") is None:
        raise CommandError(MISSING, FAILURE)
    from actors.cli.top_view import live  # noqa: PLC0415 - needs textual

    return live.run(options)


def _has_terminal() -> bool:
    """Tell whether there is a terminal that can show more than lines."""
    if os.environ.get("TERM") == "dumb" or sys.stdin is None:
        return False
    return sys.stdin.isatty() and sys.stdout.isatty()


def _print(options: argparse.Namespace) -> int:
    for seen in _overviews(options):
        if options.json:
            say_json(seen.as_dict())
        else:
            _say_tables(seen)
        if options.once:
            break
    return OK


def _overviews(options: argparse.Namespace) -> Generator[Overview]:
    """Look again and again; the first look has no rates and is left out.

    Each look has a connection of its own: one that only waits would be taken for silent.
    """
    looks = Looks(window=1)
    while True:
        with inspector(options) as look:
            seen = looks.add(Look(look.graph(), look.report()))
        if seen.seconds:
            yield _wanted(seen, options)
        time.sleep(options.interval)


def _wanted(seen: Overview, options: argparse.Namespace) -> Overview:
    shown = seen if options.include_hidden else seen.without_hidden()
    topics, nodes, services = found_in(shown, options.filter)
    return replace(shown, topics=tuple(topics), nodes=tuple(nodes), services=tuple(services))


def _say_tables(seen: Overview) -> None:
    color = colored(sys.stdout)
    for line in headlines(seen.totals):
        print("  ".join(painted(part.text, part.style, color=color) for part in line))
    _say_rows(TOPICS, seen.topics)
    _say_rows(NODES, seen.nodes)
    _say_rows(SERVICES, seen.services)


def _say_rows(columns: Sequence[Column[RowT]], rows: Sequence[RowT]) -> None:
    if not rows:
        return
    say("")
    say_table(
        [[column.cell(row) for column in columns] for row in rows],
        header=[column.title for column in columns],
        style=[column.style for column in columns],
    )
