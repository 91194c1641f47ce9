"""`callboard bag check`: read a whole bag, and say what is wrong."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.bag import arguments
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard bag check trip": "read all messages, and exit with 1 if anything is wrong",
    "callboard bag check trip/trip_0.mcap --json": "one file, with JSON for programs",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    add_json_option(parser)


def run(options: Options) -> int:
    """Print what is wrong."""
    from actors.bags.operations.check import check
    from actors.bags.reader import Reader
    from actors.cli.commands.bag.summaries import messages_of_topics
    from actors.cli.errors import FAILURE, OK
    from actors.cli.output import print_json, print_out

    with Reader(options.bag_path) as reader:
        report = check(reader)
    if options.json:
        print_json(
            {
                "messages": dict(report.messages),
                "invalid": dict(report.invalid),
                "problem_count": report.problem_count,
                "problems": report.problems,
            }
        )
    else:
        for problem in report.problems:
            print_out(problem)
        if more := report.problem_count - len(report.problems):
            print_out(f"and {more} more")
        bad = sum(report.invalid.values())
        print_out(f"{messages_of_topics(report.messages)} can be decoded, {bad:,} cannot")
    return FAILURE if report.problem_count else OK
