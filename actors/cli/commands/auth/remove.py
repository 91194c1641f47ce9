"""`callboard auth remove`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.auth import add_file_option, rules_file

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {"callboard auth remove robot1": "its tokens are not valid any more"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("user", metavar="USER", help="the user's name")
    add_file_option(parser)


def run(options: Options) -> int:
    """Remove a user."""
    from actors.cli.output import print_err
    from broker.access.editing import remove_user
    from broker.access.files import edit_rules

    file = rules_file(options)
    edit_rules(file, lambda text: remove_user(text, options.user, source=str(file)))
    print_err(f"Removed '{options.user}' from {file}. A running broker reads the file again at SIGHUP.")
    return 0
