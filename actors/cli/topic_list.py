"""`callboard topic list`."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from actors.cli.names_list import list_names, types_shown
from actors.cli.output import say_json
from actors.cli.place import inspector
from actors.cli.tables import Styled, say_styled
from proto.codes import EntryKind
from proto.names import is_hidden

if TYPE_CHECKING:
    import argparse

    from actors.graph.snapshot import NamesAndTypes

_BLOCKS: Final = (
    ("Published topics:", EntryKind.PUBLISHER, "publisher"),
    ("Subscribed topics:", EntryKind.SUBSCRIPTION, "subscriber"),
)


def run(options: argparse.Namespace) -> int:
    """Print the topics that have a publisher or a subscription."""
    if options.verbose and not options.count_topics:
        return _verbose(options)
    return list_names(
        options,
        EntryKind.PUBLISHER,
        EntryKind.SUBSCRIPTION,
        hidden=options.include_hidden_topics,
        types=options.show_types,
        only_count=options.count_topics,
    )


def _verbose(options: argparse.Namespace) -> int:
    with inspector(options) as look:
        snapshot = look.graph()
    counts = {
        kind: Counter(entry.name for entry in snapshot.of_kind(kind))
        for kind in (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
    }
    topics = [
        (name, types)
        for name, types in snapshot.names_and_types(*counts)
        if options.include_hidden_topics or not is_hidden(name)
    ]
    if options.json:
        say_json(
            [
                {
                    "name": name,
                    "types": types,
                    "publisher_count": counts[EntryKind.PUBLISHER][name],
                    "subscription_count": counts[EntryKind.SUBSCRIPTION][name],
                }
                for name, types in topics
            ]
        )
    elif topics:
        for heading, kind, word in _BLOCKS:
            _say_block(heading, word, topics, counts[kind])
    return 0


def _say_block(heading: str, word: str, topics: NamesAndTypes, counts: Counter[str]) -> None:
    say_styled(Styled(heading, "heading"))
    for name, types in topics:
        if count := counts[name]:
            end = f" {count} {word}{'s' if count > 1 else ''}"
            say_styled(" * ", Styled(name, "name"), *types_shown(types), end)
    print()
