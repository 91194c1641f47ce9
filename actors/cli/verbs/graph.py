"""`callboard graph`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parsing import add_broker_options, add_json_option, count

if TYPE_CHECKING:
    import argparse

EXAMPLES: Final = {
    "callboard graph": "who talks to whom, as a picture in the terminal",
    "callboard graph --nodes-only --namespace /robot1": "the nodes of a namespace, and what joins them",
    "callboard graph --output graph.svg": "a picture for a browser or a document",
    "callboard graph --format mermaid": "a flow chart to paste into Markdown",
}
FORMATS: Final = ("text", "svg", "dot", "mermaid", "json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--format", choices=FORMATS, help="what to write; default: what the output file's name says, or text"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write into a file, not to stdout")
    parser.add_argument(
        "--nodes-only",
        action="store_true",
        help="arrows from node to node, labelled with topics and services",
    )
    parser.add_argument("--namespace", metavar="NS", default="", help="only nodes in this namespace")
    parser.add_argument("--no-services", action="store_true", help="leave services out")
    parser.add_argument(
        "--hide-dead-sinks", action="store_true", help="leave out topics without subscriptions"
    )
    parser.add_argument(
        "--hide-leaf-topics", action="store_true", help="leave out topics with one connection only"
    )
    parser.add_argument("--include-hidden", action="store_true", help="also names with a leading _")
    parser.add_argument(
        "--include-debug",
        action="store_true",
        help="also /rosout, /clock, /parameter_events, rqt and rviz, and services about parameters",
    )
    parser.add_argument(
        "--width",
        type=count,
        metavar="N",
        help="columns for text; default: the terminal's, or as many as needed",
    )
    parser.add_argument("--ascii", action="store_true", help="text without box characters")
    add_json_option(parser, "one document: nodes, topics, services, edges; the same as --format json")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run it."""
    from actors.cli import graph

    return graph.run(options)
