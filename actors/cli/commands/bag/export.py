"""`callboard bag export`: write the messages of a bag as tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.commands.bag import arguments

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard bag export trip --csv": "one .csv file per topic, into trip_csv",
    "callboard bag export trip --csv -o tables --topics /imu /odom": "two topics, into tables",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    parser.add_argument(
        "--csv", action="store_true", required=True,
        help="comma-separated values: one column per field, sequences as JSON, bytes as base64",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="DIR", help="the folder for the tables; default: BAG_csv")
    arguments.add_topics(parser)


def run(options: Options) -> int:
    """Write the tables."""
    from actors.bags.operations.export import export_csv
    from actors.bags.reader import Reader
    from actors.cli.commands.bag.summaries import counted
    from actors.cli.output import print_out

    path = Path(options.bag_path)
    folder = Path(options.output) if options.output else path.with_name(f"{path.stem}_csv")
    with Reader(path) as reader:
        for topic, (file, count) in export_csv(reader, folder, options.topics).items():
            print_out(f"{file}: {counted(count, 'message')} of {topic}")
    return 0
