"""`callboard bag convert`: convert bags into a new one."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from actors.cli.commands.bag import arguments

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard bag convert old.db3 -o new": "a SQLite bag as MCAP files, with the definitions of its types",
    "callboard bag convert trip -o small --compression zstd --topics /imu": "one topic, compressed",
    "callboard bag convert monday tuesday -o both -d 600": "two bags as one, in files of ten minutes",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("bags", nargs="*", metavar="BAG", help="the folder of a bag, or a .mcap or .db3 file")
    parser.add_argument(
        "-i", "--input", nargs="+", action="append", default=[], metavar="BAG",
        help="a bag, as in ROS 2; the format of its files, which may follow, is ignored",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="the new bag")
    arguments.add_topics(parser)
    arguments.add_compression(parser)
    arguments.add_file_limits(parser)


def run(options: Options) -> int:
    """Write the new bag."""
    from actors.bags.operations.convert import convert
    from actors.bags.reader import Reader
    from actors.bags.writer import Writer
    from actors.cli.commands.bag.summaries import messages_of_topics
    from actors.cli.errors import USAGE, CommandError
    from actors.cli.output import print_out

    paths = [*options.bags, *(words[0] for words in options.input)]
    if not paths:
        raise CommandError("Name the bags to convert: callboard bag convert BAG -o DIR", USAGE)
    with ExitStack() as stack:
        readers = [stack.enter_context(Reader(path)) for path in paths]
        for reader in readers:
            _ = reader.topics  # so that no new bag is created if one cannot be read
        with arguments.usage_errors():
            writer = Writer(
                options.output,
                compression=options.compression,
                max_bag_size=options.max_bag_size,
                max_bag_duration_sec=options.max_bag_duration,
            )
        with writer:
            counts = convert(readers, writer, options.topics)
    print_out(f"{options.output}: {messages_of_topics(counts)}")
    return 0
