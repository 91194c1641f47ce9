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
    from broker.access.files import read_text
    from broker.private_file import write_private

    file = rules_file(options)
    changed = remove_user(read_text(file), options.user, source=str(file))
    write_private(file, changed, keep_mode=True)
    print_err(f"Removed '{options.user}' from {file}. A running broker reads the file again at SIGHUP.")
    return 0
