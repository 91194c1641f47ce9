"""`callboard auth list`."""

from __future__ import annotations

from typing import Any, Final

from actors.cli.commands.auth import add_file_option, rules_file
from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {"callboard auth list": "the users, their roles, and how they identify themselves"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_file_option(parser)
    add_json_option(parser, "a list of {name, tokens, certificates, roles, local}")


def run(options: Options) -> int:
    """Print all users."""
    from actors.cli.output import print_json
    from actors.cli.tables import print_table
    from broker.access.files import load_rules

    rules = load_rules(rules_file(options))
    users: list[dict[str, Any]] = [
        {
            "name": user.name,
            "tokens": len(user.tokens),
            "certificates": list(user.certificates),
            "roles": list(user.roles),
            "local": user.name == rules.local_user,
        }
        for user in rules.users.values()
    ]
    if options.json:
        print_json(users)
        return 0
    rows = [
        (
            user["name"],
            user["tokens"],
            ", ".join(user["certificates"] + ["this machine"] * user["local"]),
            ", ".join(user["roles"]),
        )
        for user in users
    ]
    header = ("USER", "TOKENS", "ALSO BY", "ROLES")
    print_table(rows, header=header, style=("name", "count", "", ""))
    return 0
