"""`callboard auth add`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.auth import add_file_option, add_token_file_option, hand_over, rules_file

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard auth add robot1 --role full --token-file robot1.token": "write the token to a file",
    "callboard auth add me --role observer --file access.toml": "print the token",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("user", metavar="USER", help="letters, digits, - and _")
    parser.add_argument(
        "--role",
        metavar="ROLE",
        action="append",
        default=[],
        help="what the user may do; may be repeated. A new file has the roles full, observer and monitor",
    )
    add_token_file_option(parser)
    add_file_option(parser)


def run(options: Options) -> int:
    """Add a user."""
    from actors.cli.output import print_err
    from broker.access.credentials import hash_token
    from broker.access.editing import NEW_FILE, add_user
    from broker.access.files import edit_rules, new_token

    file = rules_file(options)
    token = new_token()

    def change(text: str) -> str:
        return add_user(text, options.user, token=hash_token(token), roles=options.role, source=str(file))

    edit_rules(file, change, new=NEW_FILE)
    hand_over(token, options, f"Added '{options.user}' to {file}.")
    if not options.role:
        print_err(f"'{options.user}' has no roles and may do nothing: add some to users.{options.user}.roles")
    return 0
