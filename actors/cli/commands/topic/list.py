"""`callboard topic list`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.named import TOPIC, add_hidden_option, add_list_options, list_names, types_shown
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option
from proto.names import is_hidden

if TYPE_CHECKING:
    from collections import Counter

    from actors.graph.snapshot import NamesAndTypes

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
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print the topics that have a publisher or a subscription."""
    if options.count_topics or not options.verbose:
        return list_names(TOPIC, options)
    from collections import Counter

    from actors.cli.broker_target import open_inspector
    from actors.cli.output import print_json

    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
    topics = [
        (name, types)
        for name, types in snapshot.names_and_types(*TOPIC.kinds)
        if options.include_hidden_topics or not is_hidden(name)
    ]
    publishers, subscriptions = (
        Counter(entry.name for entry in snapshot.of_kind(kind)) for kind in TOPIC.kinds
    )
    if options.json:
        print_json(
            [
                {
                    "name": name,
                    "types": types,
                    "publisher_count": publishers[name],
                    "subscription_count": subscriptions[name],
                }
                for name, types in topics
            ]
        )
    elif topics:
        _print_block("Published topics:", "publisher", topics, publishers)
        _print_block("Subscribed topics:", "subscriber", topics, subscriptions)
    return 0


def _print_block(heading: str, word: str, topics: NamesAndTypes, counts: Counter[str]) -> None:
    from actors.cli.tables import Styled, print_styled

    print_styled(Styled(heading, "heading"))
    for name, types in topics:
        if count := counts[name]:
            end = f" {count} {word}{'s' if count > 1 else ''}"
            print_styled(" * ", Styled(name, "name"), *types_shown(types), end)
    print()
