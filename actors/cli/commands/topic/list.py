"""`callboard topic list`."""

from __future__ import annotations

from typing import Any, Final

from actors.cli.named import TOPIC, add_hidden_option, add_list_options, list_names, types_shown
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options

EXAMPLES: Final = {
    "callboard topic list -t": "all topics, with their types",
    "callboard topic list -v": "also how many publishers and subscriptions each has",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_list_options(TOPIC, parser)
    parser.add_flag("-v", "--verbose", help="with types and how many publishers and subscriptions")
    add_hidden_option(TOPIC, parser)
    add_json_option(
        parser, "one array of topics: name, types; with -v also publisher_count, subscription_count"
    )
    add_ros_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the topics that have a publisher or a subscription."""
    if options.count_topics or not options.verbose:
        return list_names(TOPIC, options)
    from actors.cli.broker_target import open_inspector
    from actors.cli.output import print_json
    from actors.tools import graph_documents

    with open_inspector(options) as inspector:
        topics = graph_documents.topics(inspector.graph(), hidden=options.include_hidden_topics)
    if options.json:
        print_json(topics)
    elif topics:
        _print_block("Published topics:", "publisher", topics, "publisher_count")
        _print_block("Subscribed topics:", "subscriber", topics, "subscription_count")
    return 0


def _print_block(heading: str, word: str, topics: list[dict[str, Any]], count_key: str) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled(Styled(heading, "heading"))
    for topic in topics:
        if count := topic[count_key]:
            end = f" {count} {word}{'s' if count > 1 else ''}"
            print_styled(" * ", Styled(topic["name"], "name"), *types_shown(topic["types"]), end)
    print()
