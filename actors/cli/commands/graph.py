"""`callboard graph`: a drawing of the graph."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.errors import USAGE, CommandError
from actors.cli.output import print_err
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, count
from actors.cli.terminal import terminal_width
from actors.tools.suggestions import did_you_mean
from proto.wire.names import normalize_namespace, split_node_name, validate_namespace

if TYPE_CHECKING:
    from actors.tools.graph_drawing.model import GraphFilter, GraphModel

_BY_SUFFIX: Final = {
    ".svg": "svg",
    ".dot": "dot",
    ".gv": "dot",
    ".mmd": "mermaid",
    ".mermaid": "mermaid",
    ".json": "json",
    ".txt": "text",
    "": "text",
}
EXAMPLES: Final = {
    "callboard graph": "nodes, topics and services, drawn in the terminal",
    "callboard graph --nodes-only --namespace /robot1": "the nodes of a namespace, and their connections",
    "callboard graph --output graph.svg": "a drawing for a browser or a document",
    "callboard graph --format mermaid": "a flow chart to paste into Markdown",
}
FORMATS: Final = ("text", "svg", "dot", "mermaid", "json")
_BOXES: Final = "╭─╎▶✗"
"""A sample of the characters of a drawing."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--format", choices=FORMATS, help="what to write; default: what the output file's name says, or text"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write into a file, not to stdout")
    parser.add_flag(
        "--nodes-only",
        help="arrows from node to node, labelled with topics and services",
    )
    parser.add_argument("--namespace", metavar="NS", default="", help="only nodes in this namespace")
    parser.add_flag("--no-services", help="leave services out")
    parser.add_flag("--hide-dead-sinks", help="leave out topics without subscriptions")
    parser.add_flag("--hide-leaf-topics", help="leave out topics with one connection only")
    parser.add_flag("--include-hidden", help="also names with a leading _")
    parser.add_flag(
        "--include-debug",
        help="also /rosout, /clock, /parameter_events, rqt and rviz, and services about parameters",
    )
    parser.add_argument(
        "--width",
        type=count,
        metavar="N",
        help="columns for text; default: the terminal's, or as many as needed",
    )
    parser.add_flag("--ascii", help="text without box characters")
    add_json_option(
        parser, "one document: nodes, topics, services, edges, mismatches; the same as --format json"
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the drawing, or write it to a file."""
    from actors.cli.broker_target import open_inspector
    from actors.cli.mesh_names import read_broker_names
    from actors.cli.named import print_mismatches
    from actors.tools.graph_drawing.model import model_of

    chosen, kind = _filter(options), _format(options)
    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
        names = read_broker_names(inspector, snapshot)
    brokers = {} if names is None else snapshot.node_brokers()
    places = {} if names is None else {node: names.joined(each) for node, each in brokers.items()}
    model = model_of(snapshot, chosen, places)
    if chosen.namespace and not model.vertices:
        raise CommandError(_no_namespace(chosen.namespace, snapshot.nodes()))
    text = _rendered(model, kind, options)
    if options.output is not None:
        Path(options.output).write_text(f"{text}\n", encoding="utf-8")
    elif text:
        print(text)
    print_mismatches(model.mismatches)
    if not model.vertices:
        print_err(_nothing(len(snapshot.nodes())))
    return 0


def _filter(options: Options) -> GraphFilter:
    from actors.tools.graph_drawing.model import GraphFilter

    namespace = normalize_namespace(options.namespace.rstrip("/")) if options.namespace.strip("/") else ""
    if namespace:
        validate_namespace(namespace)
    return GraphFilter(
        hidden=options.include_hidden,
        debug=options.include_debug,
        dead_sinks=not options.hide_dead_sinks,
        leaf_topics=not options.hide_leaf_topics,
        services=not options.no_services,
        namespace=namespace,
        nodes_only=options.nodes_only,
    )


def _format(options: Options) -> str:
    """Return the output format.

    Raises:
        CommandError: `--json` and `--format` contradict each other, or the file's suffix is unknown.
    """
    if options.json:
        if options.format not in {None, "json"}:
            raise CommandError(f"callboard graph: --json contradicts --format {options.format}", USAGE)
        return "json"
    if options.format is not None:
        return str(options.format)
    suffix = Path(options.output or "").suffix
    if suffix.lower() not in _BY_SUFFIX:
        known = ", ".join(filter(None, _BY_SUFFIX))
        raise CommandError(
            f"callboard graph: no format is known for '{suffix}': call the file {known}, or say --format",
            USAGE,
        )
    return _BY_SUFFIX[suffix.lower()]


def _rendered(model: GraphModel, kind: str, options: Options) -> str:

    from actors.cli.tables import colored
    from actors.tools.graph_drawing.model import document_of

    if kind == "json":
        return json.dumps(document_of(model))
    if kind == "svg":
        from actors.tools.graph_drawing.svg import svg_of

        return svg_of(model)
    if kind == "dot":
        from actors.tools.graph_drawing.dot import dot_of

        return dot_of(model)
    if kind == "mermaid":
        from actors.tools.graph_drawing.mermaid import mermaid_of

        return mermaid_of(model)
    from actors.tools.graph_drawing.text import text_of

    to_file = options.output is not None
    return text_of(
        model,
        width=options.width or (None if to_file else terminal_width()),
        color=not to_file and colored(sys.stdout),
        ascii_only=options.ascii or not (to_file or _has_boxes(sys.stdout.encoding)),
    )


def _has_boxes(encoding: str | None) -> bool:
    try:
        _BOXES.encode(encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True


def _nothing(nodes: int) -> str:
    if not nodes:
        return "There is nothing to draw: no nodes are running."
    return f"Left out: hidden nodes and such for debugging ({nodes}); see --include-hidden, --include-debug"


def _no_namespace(namespace: str, nodes: list[str]) -> str:
    spaces = {split_node_name(node)[0] for node in nodes}
    return f"No nodes in namespace '{namespace}'{did_you_mean(namespace, spaces)}"
