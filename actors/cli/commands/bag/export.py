"""`callboard bag export`: write the messages of a bag as tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard bag export trip --csv": "a .csv file for each topic, into trip_csv",
    "callboard bag export trip --csv -o tables --topics /imu /odom": "of two topics",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag, or a file: .mcap or .db3")
    parser.add_argument(
        "--csv", action="store_true", required=True,
        help="comma-separated values: a column for each field, a sequence as JSON, bytes as base64",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="DIR", help="where to write; default: BAG_csv")
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these topics")


def run(options: Options) -> int:
    """Write the tables."""
    from actors.bags.export import export_csv
    from actors.bags.reader import Reader
    from actors.cli.output import print_out

    path = Path(options.bag_path)
    folder = Path(options.output) if options.output else path.with_name(f"{path.stem}_csv")
    with Reader(path) as reader:
        for topic, (file, count) in export_csv(reader, folder, options.topics).items():
            print_out(f"{file}: {count} messages of {topic}")
    return 0
