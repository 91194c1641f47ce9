"""`callboard bridge info`: what crosses the bridges of a graph, and what does not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

if TYPE_CHECKING:
    from collections.abc import Iterator

EXAMPLES: Final = {
    "callboard bridge info": "all bridges: what crosses, drops, and what does not cross and why",
    "callboard bridge info --json": "the same for programs",
}

ANSWER_SEC: Final = 5.0
"""How long each bridge may take to answer."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_json_option(parser, "a list with an object for each bridge: shown, topics, services, refusals")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print what each bridge reports."""
    from actors.cli.errors import CommandError
    from actors.cli.loop import run_async
    from actors.cli.output import print_json, print_out

    documents = run_async(lambda: _ask(options))
    if options.json:
        print_json(documents)
    elif not documents:
        raise CommandError("there is no bridge in this graph; start one with: callboard bridge ros2")
    for document in [] if options.json else documents:
        for line in _lines(document):
            print_out(line)
    return 0


async def _ask(options: Options) -> list[dict[str, Any]]:
    import json

    from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_STATE_LABEL
    from actors.cli.errors import CommandError
    from actors.cli.hidden_node import hidden_node
    from actors.errors import CallFailed
    from actors.interfaces.std_srvs.srv import Trigger

    documents: list[dict[str, Any]] = []
    async with hidden_node(options) as node:
        labels = (await node.get_graph()).node_labels()
        bridges = [
            name
            for name, each in labels.items()
            if BRIDGE_ID_LABEL in each and BRIDGE_STATE_LABEL not in each
        ]
        for name in sorted(bridges):
            client = node.create_client(Trigger, f"{name}/get_report")
            try:
                answer = await client.call(Trigger.Request(), timeout_sec=ANSWER_SEC)
            except CallFailed as error:
                raise CommandError(f"the bridge {name} does not answer: {error}") from None
            documents.append({"node": name, **json.loads(answer.message)})
    return documents


def _lines(document: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a bridge."""
    shown = document["shown"]
    state = "active" if document["active"] else f"waits for bridge {document['waits_for'] or '?'}"
    yield f"{document['node']}: {document['network']}, {state}"
    yield f"  ROS 2: {document['distribution']}, {document['rmw']}"
    if not document["has_own_profile"]:
        yield "  The middleware has a configuration of its own: a killed bridge is shown there for its lease"
    if not document["active"]:
        return
    for side, words in (("callboard", "nodes of ROS 2 here"), ("ros2", "nodes of callboard in ROS 2")):
        yield f"  {shown[side]['nodes']} {words}, with {shown[side]['endpoints']} endpoints"
    for kind in ("topics", "services"):
        yield f"  {kind.capitalize()}:"
        used = [row for row in document[kind] if row["received"] or row["dropped"]]
        for row in used:
            yield f"    {row['name']}{_direction(kind, row)}: {_counts(row)}"
        idle = len(document[kind]) - len(used)
        if idle:
            yield f"    {idle} {'others ' if used else ''}have not been used"
    refused = list(_refused(document))
    yield "  Does not cross:" if refused else "  Does not cross: nothing that was tried"
    yield from (f"    {line}" for line in refused)


def _refused(document: dict[str, Any]) -> Iterator[str]:
    for refusal in document["refusals"]:
        if not refusal["quiet"]:
            yield f"{refusal['name']}: {refusal['text']}"
    for text in document["refused_by_broker"]:
        yield f"the broker refuses {text}"
    yield from document["failures"]


def _direction(kind: str, row: dict[str, Any]) -> str:
    if kind == "topics":
        return " from ROS 2" if row["from_theirs"] else " to ROS 2"
    return " served here" if row["from_theirs"] else " served in ROS 2"


def _counts(row: dict[str, Any]) -> str:
    parts = [f"{row['received']} received, {row['sent']} passed on"]
    parts += [f"{row[key]} {key}" for key in ("lost", "repeated") if row[key]]
    for reason, count in row["dropped"].items():
        example = row["examples"].get(reason)
        parts.append(f"{count} dropped ({reason}{f': {example}' if example else ''})")
    return ", ".join(parts)
