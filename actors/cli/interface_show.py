"""`callboard interface show`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

from actors.cli.errors import USAGE, CommandError
from actors.cli.here import look_here
from actors.cli.output import say, say_json
from actors.cli.place import inspector
from actors.errors import BrokerUnreachable
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.outline import Comments, outline
from actors.tools.definitions import full_name, local_text, texts_in_graph

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    TextOf = Callable[[str], str | None]

MAX_LINE_LENGTH: Final = 1000
"""Characters that are read of stdin's first line: no type's name is as long."""


def run(options: argparse.Namespace) -> int:
    """Print a definition, with those of the messages it contains below."""
    look_here()
    name, text_of = _found(_from_stdin() if options.type == "-" else options.type, options)
    if options.json:
        say_json({"name": name, "definition": text_of(name) or ""})
        return 0
    comments = Comments.ALL if options.all_comments else Comments.OWN
    lines = outline(name, text_of, Comments.NONE if options.no_comments else comments)
    if lines:
        say("\n".join(lines))
    return 0


def _from_stdin() -> str:
    if sys.stdin is None or sys.stdin.closed:
        raise CommandError("There is nothing to read from: stdin is closed")
    if sys.stdin.isatty():
        raise CommandError("'-' reads the type from a pipe: callboard topic type /chatter | …", USAGE)
    try:
        name = sys.stdin.readline(MAX_LINE_LENGTH).strip()
    except UnicodeDecodeError as error:
        raise CommandError(f"What comes on stdin is no text: {error.reason}") from None
    if not name:
        raise CommandError("stdin names no type", USAGE)
    return name


def _found(name: str, options: argparse.Namespace) -> tuple[str, TextOf]:
    """Return a type's full name and where texts are: here, or where nodes have declared them."""
    try:
        return full_name(name), local_text
    except UnknownInterfaceError:
        texts = _declared(name, options) if name.count("/") == 2 else {}
        if not texts:
            raise
        return name, texts.get


def _declared(name: str, options: argparse.Namespace) -> dict[str, str]:
    try:
        with inspector(options) as look:
            return texts_in_graph(look, name)
    except BrokerUnreachable:  # that the type is unknown says more
        return {}
