"""`callboard mesh list`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

EXAMPLES: Final = {"callboard mesh list": "the brokers, what they have, and how far away they are"}
_STYLES: Final = ("name", "dim", "dim", "count", "count", "count", "")


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_json_option(
        parser, "one array of brokers: name, id, version, nodes, endpoints, round_trip_sec, route"
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the brokers of the mesh; the first is the one that answers."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.commands.mesh.rows import ROUTES, document_of, rows_of
    from actors.cli.output import print_json
    from actors.cli.tables import print_table

    with open_inspector(options) as inspector:
        rows = rows_of(inspector)
    if options.json:
        print_json([document_of(row) for row in rows])
        return 0
    print_table(
        [
            (
                row.stats.name or "?",
                row.id,
                row.stats.version or "?",
                row.nodes,
                row.endpoints,
                row.round_trip,
                ROUTES[row.route],
            )
            for row in rows
        ],
        header=("BROKER", "ID", "VERSION", "NODES", "ENDPOINTS", "ROUND TRIP", "ROUTE"),
        style=_STYLES,
    )
    return 0
