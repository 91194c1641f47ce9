"""`callboard node`: list."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.parsing import add_broker_options, add_json_option, add_verbs

if TYPE_CHECKING:
    import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the verb."""
    listing = add_verbs(parser)("list", "list nodes")
    listing.add_argument("-a", "--all", action="store_true", help="also hidden ones, with a leading _")
    listing.add_argument("-c", "--count-nodes", action="store_true", help="only how many there are")
    add_json_option(listing)
    add_broker_options(listing)


def run(options: argparse.Namespace) -> int:
    """Print the nodes' full names."""
    from actors.cli.loop import run_async  # noqa: PLC0415 - `--help` needs no asyncio
    from actors.cli.output import say, say_json  # noqa: PLC0415
    from actors.cli.session import graph_of, session  # noqa: PLC0415
    from proto.names import is_hidden  # noqa: PLC0415

    async def ask() -> list[str]:
        async with session(options) as node:
            return (await graph_of(node)).nodes()

    found = [name for name in run_async(ask) if options.all or not is_hidden(name)]
    if options.count_nodes:
        say_json(len(found))
    elif options.json:
        say_json([{"name": name} for name in found])
    else:
        for name in found:
            say(name)
    return 0
