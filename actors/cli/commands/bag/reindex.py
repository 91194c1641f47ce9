"""`callboard bag reindex`: write the metadata.yaml of a bag."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import IGNORED, Options, Parser

EXAMPLES: Final = {"callboard bag reindex trip": "from what its files have, after its recorder was killed"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag")
    parser.add_argument(
        "-s", "--storage", choices=("mcap", "sqlite3"), help=f"{IGNORED} a file says itself what it is"
    )


def run(options: Options) -> int:
    """Write it."""
    from actors.bags.recover import reindex
    from actors.cli.output import print_out, print_warning

    summary = reindex(options.bag_path)
    for problem in summary.problems:
        print_warning(problem)
    if summary.problems:
        print_warning(
            f"other tools may not read such files; callboard bag recover {options.bag_path} writes them anew"
        )
    print_out(
        f"{options.bag_path}/metadata.yaml: {len(summary.files)} files, {len(summary.topics)} topics, "
        f"{summary.message_count} messages"
    )
    return 0
