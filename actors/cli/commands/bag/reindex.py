"""`callboard bag reindex`: write the metadata.yaml of a bag again, from its files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.bag import arguments

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {"callboard bag reindex trip": "after its recorder was killed"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag")
    arguments.add_storage(parser)


def run(options: Options) -> int:
    """Write metadata.yaml."""
    from actors.bags.operations.recover import reindex
    from actors.cli.commands.bag.summaries import counted
    from actors.cli.output import print_out, print_warning

    summary = reindex(options.bag_path)
    for problem in summary.problems:
        print_warning(problem)
    if summary.problems:
        print_warning(
            f"other tools may not read such files; to repair them: callboard bag recover {options.bag_path}"
        )
    print_out(
        f"{options.bag_path}/metadata.yaml: {counted(len(summary.files), 'file')},"
        f" {counted(len(summary.topics), 'topic')}, {counted(summary.message_count, 'message')}"
    )
    return 0
