"""`callboard bag convert`: write bags anew, with other settings."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Final

from actors.cli.parsing import Options, Parser, count_or_zero

EXAMPLES: Final = {
    "callboard bag convert old.db3 -o new": "a SQLite bag as MCAP files, with the definitions of its types",
    "callboard bag convert trip -o small --compression zstd --topics /imu": "one topic, compressed",
    "callboard bag convert monday tuesday -o both -d 600": "two bags as one, in files of ten minutes",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bags", nargs="*", metavar="BAG", help="the folders of bags, or files")
    parser.add_argument(
        "-i", "--input", nargs="+", action="append", default=[], metavar="BAG",
        help="a bag, as in ROS 2; what follows it, the kind of its files, changes nothing",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="the new bag")
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these topics")
    parser.add_argument(
        "--compression", choices=("none", "zstd", "lz4"), default="none", metavar="NAME",
        help="compress the chunks of files: zstd, lz4, or none, the default",
    )  # fmt: skip
    parser.add_argument(
        "-b", "--max-bag-size", type=count_or_zero, metavar="BYTES", default=0,
        help="begin the next file after this size; default: never",
    )  # fmt: skip
    parser.add_argument(
        "-d", "--max-bag-duration", type=count_or_zero, metavar="SEC", default=0,
        help="begin the next file after this time; default: never",
    )  # fmt: skip


def run(options: Options) -> int:
    """Write the new bag."""
    from actors.bags.convert import convert
    from actors.bags.reader import Reader
    from actors.bags.writer import Writer
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.output import print_out

    paths = [*options.bags, *(words[0] for words in options.input)]
    if not paths:
        raise CommandError("Name the bags to convert: callboard bag convert BAG -o DIR", USAGE)
    with ExitStack() as stack:
        readers = [stack.enter_context(Reader(path)) for path in paths]
        for reader in readers:
            _ = reader.topics  # a bag that cannot be read makes no new one
        try:
            writer = Writer(
                options.output,
                compression=options.compression,
                max_bag_size=options.max_bag_size,
                max_bag_duration_sec=options.max_bag_duration,
            )
        except ValueError as error:
            raise CommandError(str(error), USAGE) from None
        with writer:
            counts = convert(readers, writer, options.topics)
    print_out(f"{options.output}: {sum(counts.values())} messages of {len(counts)} topics")
    return 0
