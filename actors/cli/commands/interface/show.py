"""`callboard interface show`."""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING, Final

from actors.cli.errors import USAGE, CommandError
from actors.cli.parsing import (
    Options,
    Parser,
    add_broker_options,
    add_json_option,
    import_from_working_directory,
)

if TYPE_CHECKING:
    from collections.abc import Callable

EXAMPLES: Final = {
    "callboard interface show geometry_msgs/msg/Twist": "its fields, and those of what it contains",
    "callboard interface show -": "the type that comes from a pipe, as of callboard topic type /chatter",
}
MAX_LINE_LENGTH: Final = 1000
"""Characters read of stdin's first line; no type name is longer."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("type", metavar="TYPE", help="such as std_msgs/msg/String; - reads it from a pipe")
    comments = parser.add_mutually_exclusive_group()
    comments.add_argument("--all-comments", action="store_true", help="also those of what it contains")
    comments.add_argument("--no-comments", action="store_true", help="neither comments nor blank lines")
    add_json_option(parser, "one object: name, definition")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print a definition, with those of the messages it contains below."""
    from actors.cli.output import print_json, print_out
    from actors.interfaces.outline import Comments, outline

    import_from_working_directory()
    name, text_of = _find(_read_stdin() if options.type == "-" else options.type, options)
    if options.json:
        print_json({"name": name, "definition": text_of(name) or ""})
        return 0
    comments = Comments.ALL if options.all_comments else Comments.OWN
    lines = outline(name, text_of, Comments.NONE if options.no_comments else comments)
    if lines:
        print_out("\n".join(lines))
    return 0


def _read_stdin() -> str:
    if sys.stdin is None or sys.stdin.closed:
        raise CommandError("There is nothing to read from: stdin is closed")
    if sys.stdin.isatty():
        raise CommandError("'-' reads the type from a pipe: callboard topic type /chatter | …", USAGE)
    try:
        name = sys.stdin.readline(MAX_LINE_LENGTH).strip()
    except UnicodeDecodeError as error:
        raise CommandError(f"stdin is not text: {error.reason}") from None
    if not name:
        raise CommandError("stdin names no type", USAGE)
    return name


def _find(name: str, options: Options) -> tuple[str, Callable[[str], str | None]]:
    """Return a type's full name, and a function of type names that returns their definitions."""
    from actors.cli.broker_target import open_inspector
    from actors.errors import BrokerUnreachable
    from actors.interfaces.errors import UnknownInterfaceError
    from actors.tools.definitions import full_name, local_text, texts_in_graph

    try:
        return full_name(name), partial(local_text, comments=True)
    except UnknownInterfaceError:
        texts: dict[str, str] = {}
        if name.count("/") == 2:
            try:
                with open_inspector(options) as inspector:
                    texts = texts_in_graph(inspector, name)
            except BrokerUnreachable:  # the unknown type is the better error
                pass
        if not texts:
            raise
        return name, texts.get
