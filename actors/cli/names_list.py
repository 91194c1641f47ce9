"""What verbs about topics and verbs about services have in common: names with types."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.names import unknown
from actors.cli.output import note, say, say_json
from actors.cli.place import inspector
from actors.cli.tables import Styled, say_styled
from actors.tools.suggestions import did_you_mean
from proto.names import is_hidden

if TYPE_CHECKING:
    import argparse

    from actors.graph.snapshot import NamesAndTypes
    from proto.codes import EntryKind


def list_names(
    options: argparse.Namespace, *kinds: EntryKind, hidden: bool, types: bool, only_count: bool
) -> int:
    """Print the names of endpoints of these kinds as the options want them; return the exit code."""
    found = _look(options, *kinds, hidden=hidden)
    if only_count:
        say_json(len(found))
    elif options.json:
        say_json([{"name": name, "types": kinds_of} for name, kinds_of in found])
    else:
        for name, kinds_of in found:
            say_styled(Styled(name, "name"), *types_shown(kinds_of, shown=types))
    return 0


def find_names(options: argparse.Namespace, *kinds: EntryKind, hidden: bool, only_count: bool) -> int:
    """Print the names whose type is `options.type`; return the exit code."""
    every = _look(options, *kinds, hidden=hidden)
    found = [name for name, types in every if any(_same_type(options.type, each) for each in types)]
    if only_count:
        say_json(len(found))
    elif options.json:
        say_json(found)
    else:
        for name in found:
            say(name)
    known = {each for _, types in every for each in types}
    if not found and (hint := did_you_mean(options.type, known)):
        note(f"Nothing has type '{options.type}'{hint}")
    return 0


def say_types(options: argparse.Namespace, what: str, name: str, *kinds: EntryKind, hidden: bool) -> int:
    """Print the types of a name, one a line; return the exit code.

    Args:
        options: Say where to look, and whether in JSON.
        what: "topic" or "service".
        name: Its full name.
        kinds: The endpoints that count.
        hidden: Whether hidden names count.

    Raises:
        CommandError: There is no such name.
    """
    every = dict(_look(options, *kinds, hidden=True))
    if name not in every:
        raise unknown(f"Unknown {what} '{name}'", name, every)
    if is_hidden(name) and not hidden:
        raise unknown(f"Hidden {what} '{name}': add --include-hidden-{what}s", name, ())
    if options.json:
        say_json(every[name])
    else:
        for each in every[name]:
            say(each)
    return 0


def types_shown(types: list[str], *, shown: bool = True) -> tuple[str | Styled, ...]:
    """Return ` [type, type]` as parts of a line, or nothing."""
    return (" [", Styled(", ".join(types), "type"), "]") if shown else ()


def _look(options: argparse.Namespace, *kinds: EntryKind, hidden: bool) -> NamesAndTypes:
    with inspector(options) as look:
        names = look.graph().names_and_types(*kinds)
    return [each for each in names if hidden or not is_hidden(each[0])]


def _same_type(wanted: str, found: str) -> bool:
    """Whether a type is meant; its kind may be left out, as in std_msgs/String."""
    package, _, name = found.split("/") if found.count("/") == 2 else ("", "", found)
    return wanted in {found, f"{package}/{name}"}
