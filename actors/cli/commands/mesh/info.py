"""`callboard mesh info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

if TYPE_CHECKING:
    from actors.cli.commands.mesh.rows import Row
    from actors.graph.broker_report import BrokerReport

EXAMPLES: Final = {
    "callboard mesh info": "traffic with all other brokers, what was dropped, and what waits",
    "callboard mesh info robot2": "one broker, by its name or id",
}
_PROBLEMS: Final = {
    "dropped": "dropped before they were sent: the network or another broker is slow",
    "overruns": "dropped on arrival: this broker is slow",
    "failed": "could not be sent",
    "malformed": "could not be decoded",
    "ignored": "about endpoints that were not, or no longer, known",
    "refused": "endpoints of other brokers that this one does not take",
    "rejected": "brokers removed because they broke the rules",
    "limited": "brokers that did not answer, changes that came too fast, and queries that came too often",
    "overflows": "times that too much waited for brokers, so that sessions were reset",
    "resets": "sessions with brokers reset, mostly because messages were lost",
}
_WAITING: Final = {
    "waiting_bytes": "bytes in the broker's queues",
    "sending_bytes": "bytes for the network",
    "unhandled_bytes": "bytes received and not handled yet",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "broker",
        metavar="BROKER",
        nargs="?",
        help="a name or an id, as `callboard mesh list` prints it",
    )
    add_json_option(parser, "one object: a broker as in mesh list, traffic, problems, waiting, neighbours")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the traffic of the broker that answers, or its traffic with another one."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.commands.mesh.rows import HERE, rows_of
    from actors.cli.output import print_json

    with open_inspector(options) as inspector:
        rows = rows_of(inspector)
        report = inspector.report()
    row = rows[0] if options.broker is None else _chosen(options.broker, rows)
    if options.json:
        print_json(_document(row, rows, report))
        return 0
    _print_row(row, report)
    if row.route == HERE:
        _print_counts("Problems", _PROBLEMS, report)
        _print_counts("Waiting", _WAITING, report)
        _print_neighbours(rows, report)
    return 0


def _chosen(wanted: str, rows: list[Row]) -> Row:
    """Return the broker with a name or an id.

    Raises:
        CommandError: No broker has the name, or several have it.
    """
    from actors.cli.errors import CommandError
    from actors.cli.named import unknown

    found = [row for row in rows if wanted in {row.stats.name, row.id}]
    if not found:
        raise unknown(f"No broker '{wanted}' in the mesh", wanted, [row.stats.name for row in rows])
    if len(found) > 1:
        ids = " or ".join(row.id for row in found)
        raise CommandError(f"Several brokers have the name '{wanted}': write the id, {ids}")
    return found[0]


def _traffic(row: Row, report: BrokerReport) -> dict[str, int]:
    """Return the traffic of the broker that answers with all others, or with one of them."""
    from actors.cli.commands.mesh.rows import HERE

    source = report.mesh if row.route == HERE else report.brokers[row.stats.number]
    return {name: getattr(source, name) for name in ("sent", "bytes_sent", "received", "bytes_received")}


def _document(row: Row, rows: list[Row], report: BrokerReport) -> dict[str, Any]:
    from actors.cli.commands.mesh.rows import HERE, document_of

    document = {**document_of(row), "traffic": _traffic(row, report)}
    if row.route == HERE:
        document["problems"] = {name: getattr(report.mesh, name) for name in _PROBLEMS}
        document["waiting"] = {name: getattr(report.mesh, name) for name in _WAITING}
        document["neighbours"] = _neighbours(rows, report)
    return document


def _neighbours(rows: list[Row], report: BrokerReport) -> list[dict[str, str | None]]:
    """Return what Zenoh is connected with: brokers have a name, other routers only an id."""
    from proto.wire.mesh_keys import zenoh_id

    names = {zenoh_id(row.stats.number): (row.id, row.stats.name) for row in rows}
    found = [names.get(each, (each, None)) for each in report.mesh.neighbours.split()]
    return [{"id": number, "name": name} for number, name in found]


def _print_row(row: Row, report: BrokerReport) -> None:
    from actors.cli.commands.mesh.rows import HERE, ROUTES
    from actors.cli.tables import Styled, print_styled

    traffic = _traffic(row, report)
    print_styled(Styled(row.stats.name or "?", "name"))
    alone = "" if row.route == HERE else ", to this broker alone"
    lines = {
        "Id": row.id,
        "Version": row.stats.version or "?",
        "Route": ROUTES[row.route],
        **({} if row.route == HERE else {"Round trip": row.round_trip}),
        "Nodes": f"{row.nodes}, with {row.endpoints} endpoints",
        "Sent": f"{traffic['sent']} messages, {traffic['bytes_sent']} bytes{alone}",
        "Received": f"{traffic['received']} messages, {traffic['bytes_received']} bytes",
    }
    for heading, text in lines.items():
        print_styled("  ", Styled(f"{heading}: ", "heading"), text)


def _print_counts(heading: str, names: dict[str, str], report: BrokerReport) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled("  ", Styled(f"{heading}:", "heading"))
    counts = {text: getattr(report.mesh, name) for name, text in names.items()}
    for text, count in counts.items():
        if count:
            print_styled(f"    {count} {text}")
    if not any(counts.values()):
        print_styled("    nothing")


def _print_neighbours(rows: list[Row], report: BrokerReport) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled("  ", Styled("Zenoh is connected with:", "heading"))
    for each in _neighbours(rows, report):
        print_styled("    ", f"{each['name'] or 'no broker'} ({each['id']})")
    if not report.mesh.neighbours:
        print_styled("    nothing")
