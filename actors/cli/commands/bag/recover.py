"""`callboard bag recover`: copy what can be read of a damaged bag into a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from actors.cli.commands.bag import arguments
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard bag recover trip": "into trip_recovered",
    "callboard bag recover trip/trip_3.mcap -o rest": "from one file",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="the new bag; default: BAG_recovered")
    arguments.add_compression(parser)
    add_json_option(parser)


def run(options: Options) -> int:
    """Write the new bag, and say what is in it."""
    from actors.bags.operations.recover import recover
    from actors.cli.commands.bag.summaries import counted
    from actors.cli.errors import FAILURE, OK, CommandError
    from actors.cli.output import print_json, print_out, print_warning

    path = Path(options.bag_path)
    output = Path(options.output) if options.output else path.with_name(f"{path.stem}_recovered")
    report = recover(path, output, compression=options.compression)
    if options.json:
        print_json({"output": str(output), "kept": dict(report.kept), "damages": report.damages})
        return OK if report.kept else FAILURE
    for damage in report.damages:
        print_warning(damage)
    if not report.kept:
        raise CommandError(f"No message of {path} could be read; {output} has only its topics")
    for name, count in sorted(report.kept.items()):
        print_out(f"{name}: {counted(count, 'message')}")
    kept, damages = counted(report.kept.total(), "message"), counted(len(report.damages), "damaged part")
    print_out(f"{output}: {kept} copied, {damages} left out")
    return OK
