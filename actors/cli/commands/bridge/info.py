"""`callboard bridge info`: what crosses the bridges of a graph, and what does not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.endpoints.client.client import Client
    from actors.interfaces.std_srvs.srv import Trigger

EXAMPLES: Final = {
    "callboard bridge info": "all bridges: what crosses, rates, drops, and what does not cross and why",
    "callboard bridge info --json": "the same for programs",
}

_ODD: Final = (LookupError, ValueError, TypeError, AttributeError, RecursionError)
"""What a report with other contents raises."""

ANSWER_SEC: Final = 5.0
"""How long each bridge may take to answer."""
RATE_SEC: Final = 1.0
"""Time between the two reports of a bridge from which rates are taken."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_json_option(parser, "a list with an object for each bridge: shown, topics, services, refusals")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print what each bridge reports."""
    from actors.cli.errors import CommandError
    from actors.cli.loop import run_async
    from actors.cli.output import print_json, print_out

    faults: list[str] = []
    documents = run_async(lambda: _ask(options, faults))
    if options.json:
        print_json(documents)
    elif not documents and not faults:
        raise CommandError("there is no bridge in this graph; start one with: callboard bridge ros2")
    for document in [] if options.json else documents:
        try:
            print_out("\n".join(_lines(document)))
        except _ODD:
            faults.append(_odd(document["node"]))
    if faults:
        raise CommandError("\n".join(faults))
    return 0


async def _ask(options: Options, faults: list[str]) -> list[dict[str, Any]]:
    """Return the reports of all bridges that give one; any node can say that it is a bridge."""
    import asyncio

    from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_STATE_LABEL
    from actors.cli.errors import CommandError
    from actors.cli.hidden_node import hidden_node
    from actors.interfaces.std_srvs.srv import Trigger

    async with hidden_node(options) as node:
        labels = (await node.get_graph()).node_labels()
        clients = {
            name: node.create_client(Trigger, f"{name}/get_report")
            for name, each in sorted(labels.items())
            if BRIDGE_ID_LABEL in each and BRIDGE_STATE_LABEL not in each
        }
        loop = asyncio.get_running_loop()
        before: dict[str, tuple[float, dict[str, Any]]] = {}
        documents: list[dict[str, Any]] = []
        for name, client in clients.items():
            try:
                before[name] = loop.time(), await _report(name, client)
            except CommandError as error:
                faults.append(str(error))
        if before:
            await asyncio.sleep(RATE_SEC)
        for name, (asked_at, report) in before.items():
            try:
                now = await _report(name, clients[name])
                documents.append(_with_rates(now, report, loop.time() - asked_at))
            except CommandError as error:
                faults.append(str(error))
            except _ODD:
                faults.append(_odd(name))
        return documents


async def _report(name: str, client: Client[Trigger.Request, Trigger.Response]) -> dict[str, Any]:
    import json

    from actors.cli.errors import CommandError
    from actors.errors import CallFailed
    from actors.interfaces.std_srvs.srv import Trigger

    try:
        await client.wait_for_service(ANSWER_SEC)  # a bridge that starts has none yet
        answer = await client.call(Trigger.Request(), timeout_sec=ANSWER_SEC)
    except CallFailed as error:
        raise CommandError(f"the bridge {name} does not answer: {error}") from None
    try:
        return {**json.loads(answer.message), "node": name}
    except _ODD:
        raise CommandError(_odd(name)) from None


def _odd(name: str) -> str:
    return f"the bridge {name} answers with something else than a report of this version's bridges"


def _with_rates(now: dict[str, Any], before: dict[str, Any], elapsed_sec: float) -> dict[str, Any]:
    """Return a report with the rates since an earlier one."""
    for kind in ("topics", "services"):
        received = {_key(row): row["received"] for row in before[kind]}
        for row in now[kind]:
            new = row["received"] - received.get(_key(row), 0)
            row["received_per_sec"] = round(max(0, new) / elapsed_sec, 1)
    return now


def _key(row: dict[str, Any]) -> tuple[str, str, bool]:
    return row["name"], row["type"], row["from_theirs"]


def _lines(document: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a bridge."""
    shown = document["shown"]
    waits_for = document["waits_for"]
    state = "active" if document["active"] else f"waits for bridge {waits_for}" if waits_for else "starts"
    yield f"{document['node']}: {document['network']}, {state}"
    yield f"  ROS 2: {document['distribution']}, {document['rmw']}"
    if not document["has_own_profile"]:
        yield "  The middleware has a configuration of its own: a killed bridge is shown there for its lease"
    if not document["active"]:
        return
    for side, words in (("callboard", "Nodes of ROS 2 here"), ("ros2", "Nodes of callboard in ROS 2")):
        yield f"  {words}: {shown[side]['nodes']}, with {shown[side]['endpoints']} endpoints"
    for kind in ("topics", "services"):
        used = [row for row in document[kind] if row["received"] or row["dropped"]]
        idle = len(document[kind]) - len(used)
        yield f"  {kind.capitalize()}:{'' if used or idle else ' none'}"
        for row in used:
            yield f"    {row['name']}{_direction(kind, row)}: {_counts(row)}"
        if idle:
            yield f"    {idle} {'more ' if used else ''}not used yet"
    refused = list(_refused(document))
    yield f"  Does not cross:{'' if refused else ' nothing that was tried'}"
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
    parts = [f"{row['received']} received ({row['received_per_sec']}/s)", f"{row['sent']} passed on"]
    parts += [f"{row[key]} {key}" for key in ("lost", "repeated") if row[key]]
    for reason, count in row["dropped"].items():
        example = row["examples"].get(reason)
        parts.append(f"{count} dropped ({reason}{f': {example}' if example else ''})")
    return ", ".join(parts)
