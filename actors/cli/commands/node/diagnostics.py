"""`callboard node diagnostics`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options, time_limit

if TYPE_CHECKING:
    from collections.abc import Iterable

EXAMPLES: Final = {"callboard node diagnostics /talker": "its host, process and uptime, and its callbacks"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    add_json_option(parser, "one object: node, host, pid, uptime_sec, callbacks and so on")
    add_remote_options(parser, ros=False)


def run(options: Options) -> int:
    """Print where a node runs, for how long, and what its callbacks take."""
    from actors.cli.loop import run_async
    from actors.cli.output import print_json

    found = run_async(lambda: _ask(options))
    if options.json:
        print_json(found)
    else:
        _print(found)
    return 0


async def _ask(options: Options) -> dict[str, Any]:
    from actors.cli.remote_node import remote_node
    from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
    from actors.tools import node_documents

    reason = "it is no node of callboard's, or was made with start_diagnostics_service=False"
    async with remote_node(options, "diagnostics", "get_diagnostics", reason) as (node, name):
        client = node.create_client(GetDiagnostics, f"{name}/get_diagnostics")
        response = await client.call(GetDiagnostics.Request(), time_limit(options))
        return node_documents.diagnostics(name, response)


def _print(found: dict[str, Any]) -> None:
    from actors.cli.tables import Styled, print_styled, print_table

    print_styled(Styled(found["node"], "name"))
    for heading, text in _facts(found):
        print_styled("  ", Styled(f"{heading}: ", "heading"), text)
    if not found["callbacks"]:
        return
    print()
    print_table(
        [
            (
                each["name"],
                f"{each['kind']} {each['source']}".rstrip(),
                each["calls"],
                f"{each['busy_sec']:.3f}",
                f"{1000 * each['longest_sec']:.1f}",
                each["slow"],
            )
            for each in found["callbacks"]
        ],
        header=("CALLBACK", "OF", "CALLS", "BUSY S", "LONGEST MS", "SLOW"),
        style=("name", "", "count", "count", "count", "count"),
    )
    if found["omitted_callbacks"]:
        print(f"and {found['omitted_callbacks']} more")


def _facts(found: dict[str, Any]) -> Iterable[tuple[str, str]]:
    yield "Host", found["host"]
    yield "Process", str(found["pid"])
    yield "Uptime", f"{found['uptime_sec']:.1f} s"
    yield "Connections", str(found["connections"])
    yield "Callback errors", str(found["callback_errors"])
    yield (
        "Loop lag",
        f"{1000 * found['loop_lag_sec']:.1f} ms, longest {1000 * found['longest_loop_lag_sec']:.1f} ms",
    )
