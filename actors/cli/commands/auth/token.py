"""`callboard auth token`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.auth import add_file_option, add_token_file_option, hand_over, rules_file

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard auth token robot1 --token-file robot1.token": "a second token; the first remains valid",
    "callboard auth token robot1 --revoke": "a new token; all others become invalid",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("user", metavar="USER", help="the user's name")
    parser.add_flag("--revoke", help="remove the user's other tokens")
    add_token_file_option(parser)
    add_file_option(parser)


def run(options: Options) -> int:
    """Give a user a new token."""
    from broker.access.credentials import hash_token
    from broker.access.editing import set_tokens
    from broker.access.files import edit_rules, new_token
    from broker.access.parse import parse_rules

    file = rules_file(options)
    token = new_token()

    def change(text: str) -> str:
        user = parse_rules(text, str(file)).users.get(options.user)
        others = () if user is None or options.revoke else user.tokens
        return set_tokens(text, options.user, (*others, hash_token(token)), source=str(file))

    edit_rules(file, change)
    hand_over(token, options, f"Added a token of '{options.user}' to {file}.")
    return 0
