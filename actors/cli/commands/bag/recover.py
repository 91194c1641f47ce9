"""`callboard bag recover`: write what is whole of a damaged bag into a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard bag recover trip": "into trip_recovered",
    "callboard bag recover trip/trip_3.mcap -o rest": "of one file",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag, or a file: .mcap or .db3")
    parser.add_argument("-o", "--output", metavar="DIR", help="the new bag; default: BAG_recovered")
    parser.add_argument(
        "--compression", choices=("none", "zstd", "lz4"), default="none", metavar="NAME",
        help="compress the chunks of files: zstd, lz4, or none, the default",
    )  # fmt: skip
    add_json_option(parser)


def run(options: Options) -> int:
    """Write it, and say what it has."""
    from actors.bags.recover import recover
    from actors.cli.output import print_json, print_out, print_warning

    path = Path(options.bag_path)
    output = Path(options.output) if options.output else path.with_name(f"{path.stem}_recovered")
    report = recover(path, output, compression=options.compression)
    if options.json:
        print_json({"output": str(output), "kept": dict(report.kept), "damages": report.damages})
        return 0
    for damage in report.damages:
        print_warning(damage)
    for name, count in sorted(report.kept.items()):
        print_out(f"{name}: {count} messages")
    print_out(f"{output}: {sum(report.kept.values())} messages kept, {len(report.damages)} damages left out")
    return 0
