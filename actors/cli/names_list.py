"""What `topic list` and `service list` have in common: names with types."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.output import say, say_json
from actors.cli.place import inspector
from proto.names import is_hidden

if TYPE_CHECKING:
    import argparse

    from proto.codes import EntryKind


def list_names(
    options: argparse.Namespace, *kinds: EntryKind, hidden: bool, types: bool, only_count: bool
) -> int:
    """Print the names of endpoints of these kinds as the options want them; return the exit code."""
    with inspector(options) as look:
        names = look.graph().names_and_types(*kinds)
    found = [each for each in names if hidden or not is_hidden(each[0])]
    if only_count:
        say_json(len(found))
    elif options.json:
        say_json([{"name": name, "types": kinds_of} for name, kinds_of in found])
    else:
        for name, kinds_of in found:
            say(f"{name} [{', '.join(kinds_of)}]" if types else name)
    return 0
