"""`callboard context list`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {"callboard context list": "the named brokers; * marks the one in use"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_json_option(parser, "a list of {name, url, domain, description, token_file, ca, cert, key, current}")


def run(options: Options) -> int:
    """Print all contexts."""
    from dataclasses import asdict

    from actors.cli.output import print_json
    from actors.cli.tables import Styled, print_table
    from actors.config.contexts import Contexts

    contexts = Contexts.load()
    current = contexts.current
    found = {name: contexts.get(name) for name in contexts.names()}
    if options.json:
        print_json(
            [{"name": name, **asdict(each), "current": name == current} for name, each in found.items()]
        )
        return 0
    rows = [
        (
            Styled("*" if name == current else "", "good"),
            name,
            each.url,
            "" if each.domain is None else each.domain,
            each.description,
        )
        for name, each in found.items()
    ]
    header = ("", "NAME", "URL", "DOMAIN", "DESCRIPTION")
    print_table(rows, header=header, style=("", "name", "", "count", "dim"))
    return 0
