"""`callboard pkg`: installed packages. No broker is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.tools.executables import Package

NONE_FOUND: Final = (
    "No installed package uses callboard; to make one: callboard pkg create --node-name NODE NAME"
)


def require_package(name: str, text: str) -> Package:
    """Return the installed package of this name.

    Raises:
        CommandError: There is no such package; the message is `text`, with a suggestion.
    """
    from actors.cli.errors import CommandError
    from actors.tools.executables import find_package, packages
    from actors.tools.suggestions import did_you_mean

    found = find_package(name)
    if found is None:
        raise CommandError(text + did_you_mean(name, [each.name for each in packages()]))
    return found
