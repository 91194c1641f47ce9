"""`callboard bag check`: read a bag as a whole, and say what is wrong."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard bag check trip": "read all messages, and exit with 1 if anything is wrong",
    "callboard bag check trip/trip_0.mcap --json": "of one file, for programs",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag, or a file: .mcap or .db3")
    add_json_option(parser)


def run(options: Options) -> int:
    """Print what is wrong."""
    from actors.bags.check import check
    from actors.bags.reader import Reader
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
        good, bad = sum(report.messages.values()), sum(report.invalid.values())
        print_out(f"{good} messages of {len(report.messages)} topics can be decoded, {bad} cannot")
    return FAILURE if report.problem_count else OK
