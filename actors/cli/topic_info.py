"""`callboard topic info`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.endpoints import document, say_info
from actors.cli.names import topic_name, unknown
from actors.cli.output import say_json
from actors.cli.place import inspector
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a topic's type, and who publishes and subscribes."""
    name = topic_name(options.topic)
    with inspector(options) as look:
        picture = look.graph()
    types = dict(picture.names_and_types(EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION))
    if name not in types:
        raise unknown(f"Unknown topic '{name}'", name, types)
    publishers = picture.endpoints(EntryKind.PUBLISHER, name)
    subscriptions = picture.endpoints(EntryKind.SUBSCRIPTION, name)
    if options.json:
        say_json(
            {
                "name": name,
                "types": types[name],
                "publishers": [document(each) for each in publishers],
                "subscriptions": [document(each) for each in subscriptions],
            }
        )
    else:
        counted = {"Publisher count": publishers, "Subscription count": subscriptions}
        say_info(types[name], counted, verbose=options.verbose)
    return 0
